"""Figures 7 and 12: spectra on their true frequency axis, and one stretched to other speeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from afferents import dims
from afferents.choices import Figures
from afferents.encodings.augment import stretch_spectrum
from afferents.encodings.samples import Samples, list_textures
from afferents.folds.held_out import key_of
from afferents.reporting.choice import (
    Shown,
    example_textures,
    in_condition,
    recorded_in,
    shown_for,
    speeds_of_textures,
    spread,
)
from afferents.reporting.labels import texture_names
from afferents.reporting.style import BLUE, GREY, INK, ORANGE, VERMILION, new_figure, styled
from afferents.store.recording import spacing_mm

# What Figures 7 and 12 share: one mean spectrum a condition, on its true frequency axis.
#
# The paper's Figure 12 draws 400 bins of 1 Hz against 0 to 200 Hz and labels four of its five
# speeds wrongly. Here frequency and speed are the coordinates that the spectra carry.

HIGHEST_HZ = 400.0
"""Figures show at most 0 to 400 Hz: what the paper's Figure 12 truly shows."""


def mean_spectrum(windows: Samples) -> xr.DataArray:
    """Return the mean over windows and channels, with their number in the attribute `n_windows`.

    Parameters
    ----------
    windows
        Dims (sample, channel, frequency), `frequency` in Hz; at least one.
    """
    mean = windows.mean([dim for dim in windows.dims if dim != dims.FREQUENCY])
    return mean.assign_attrs({**windows.attrs, "n_windows": windows.sizes[dims.SAMPLE]})


def amplitude_label(attrs: Mapping[object, object]) -> str:
    """Return the name of the amplitude axis, with its unit where the spectra carry one."""
    return f"amplitude ({attrs[dims.UNITS]})" if attrs.get(dims.UNITS) else "amplitude"


def amplitude_top(spectra: Sequence[xr.DataArray], to_hz: float = HIGHEST_HZ) -> float:
    """Return the top of an amplitude axis for these spectra, shown up to a frequency.

    Offset and drift, the lowest hundredth of what is shown, do not set it.
    """
    tops = [0.0]
    for spectrum in spectra:
        axis = spectrum[dims.FREQUENCY]
        highest = min(to_hz, float(axis.max()))
        tops.append(float(spectrum.where((axis >= 0.01 * highest) & (axis <= highest)).max()))
    return 1.15 * max(tops) or 1.0


# Figure 7: a spectrum stretched to half and twice its speed, beside the real ones.
#
# Sliding twice as fast doubles the frequency of what a texture does to the skin, so a spectrum
# stretched by two should look like one recorded at twice the speed. The paper shows texture i at
# 40 mm/s, stretched by 0.5 and 2, beside its real spectra at 20 and 80 mm/s.

SPACING_MM, SPEED = 4.0, 40.0
"""The example of the paper: texture i (4 mm) at 40 mm/s."""

STRETCHED_TO_HZ = 200.0
"""The networks see 0 to 200 Hz; above that there is little to compare."""


@dataclass(frozen=True)
class StretchExample:
    """A texture at a speed, at half of it and at twice, each a mean spectrum (frequency).

    `name` is what the report calls the texture.
    `middle` is what is to be stretched by 0.5 and 2; `half` and `double` are what the results
    should look like.
    """

    name: str
    speed_mm_s: float
    half: xr.DataArray
    middle: xr.DataArray
    double: xr.DataArray


def stretch_example(spectra: Samples) -> StretchExample | None:
    """Choose the example: the paper's where it is there, else another texture or speed.

    Bumpy textures come first, since a smooth one has no lines that stretching could move; then the
    speed nearest 40 mm/s whose half and double were recorded; then the spacing nearest 4 mm.

    Returns
    -------
    None where no texture has a speed together with its half and its double.
    """
    names = texture_names(list_textures(spectra), bool(spectra.attrs.get(dims.NAMED_BY_SPACING)))
    # Of many recordings, looking for each in all samples would take longer than all the rest.
    recorded = recorded_in(spectra)
    candidates = [
        (texture, speed)
        for texture, speed in recorded
        if {(texture, k * speed) for k in (0.5, 2.0)} <= recorded
    ]
    if not candidates:
        return None
    texture, speed = min(candidates, key=_unlike_the_paper)
    half, middle, double = (
        mean_spectrum(in_condition(spectra, texture, k * speed)) for k in (0.5, 1.0, 2.0)
    )
    return StretchExample(names[texture], speed, half, middle, double)


def _unlike_the_paper(condition: tuple[str, float]) -> tuple[int, float, float, str, float]:
    """Sort key: bumps, then words, then smooth; of each the nearest speed and spacing first."""
    texture, speed = condition
    spacing = spacing_mm(texture)
    kind = 1 if spacing is None else 0 if spacing > 0 else 2
    off = abs((spacing or 0.0) - SPACING_MM)
    return (kind, abs(speed - SPEED), off, texture, speed)


def stretched_by(factor: float, spectrum: xr.DataArray) -> xr.DataArray:
    """Return a spectrum stretched by rebinning, as under the nested protocol; bins as before."""
    copy = stretch_spectrum(spectrum.to_numpy(), factor)
    first, second = spectrum[dims.FREQUENCY].values[:2].astype(np.float64)
    frequency = first + (second - first) * np.arange(len(copy))
    return xr.DataArray(copy, {dims.FREQUENCY: frequency})


@styled
def stretch_figure(example: StretchExample, source: str) -> Figure:
    """Draw the spectrum, and its stretched copies over the real spectra.

    Parameters
    ----------
    example
        From `stretch_example`.
    source
        The line that says what the spectra were made from.
    """
    title = (
        f"Figure 7. Stretched (nested protocol: rebinned) and real spectra, texture {example.name}"
    )
    figure = new_figure(7.6, 5.6, title, source)
    speed, middle = example.speed_mm_s, example.middle
    reals = ((example.half, 0.5, BLUE), (middle, 1, INK), (example.double, 2, VERMILION))
    panels = figure.subplots(3, 1, sharex=True)
    for axes, (real, factor, colour) in zip(panels, reals, strict=True):
        n = real.attrs["n_windows"]
        label = f"recorded at {key_of(factor * speed)} mm/s ({n} windows)"
        axes.plot(real[dims.FREQUENCY], real, color=INK, lw=0.9, label=label)
        drawn = [real]
        if factor != 1:
            drawn.append(copy := stretched_by(factor, middle))
            label = f"{key_of(speed)} mm/s stretched by {factor:g}"
            axes.plot(copy[dims.FREQUENCY], copy, color=colour, label=label)
        axes.set_ylim(0, amplitude_top(drawn, STRETCHED_TO_HZ))
        axes.legend(loc="upper right")
    panels[-1].set_xlabel("frequency (Hz)")
    panels[1].set_ylabel(amplitude_label(middle.attrs))
    panels[-1].set_xlim(0, min(STRETCHED_TO_HZ, float(middle[dims.FREQUENCY].max())))
    return figure


# Figure 12: spectra of several textures at several speeds, on the true frequency axis.
#
# Rows are textures, columns speeds: spread over what was recorded, or, as the paper prints it, a, g
# and m at the speeds that its figure truly shows. A single window, as in the paper, lies over
# the mean. In the report each texture has its own scale of amplitude, since one that is much louder
# hides the others; in print all panels have one. The frequency axis is in true Hz: the paper's is
# off by a factor of two, and four of its five speeds are labelled wrongly.

SPEEDS = (20.0, 40.0, 50.0, 80.0, 100.0)
"""What the paper's figure truly shows; its labels say 10, 30, 50, 70, 90."""
MOST_SPEEDS = 5
LETTERS_SHOWN = ("a", "g", "m")


def shown_spectra(spectra: Samples, style: Figures) -> list[list[Shown]]:
    """Choose the panels: a row for each texture, a column for each speed."""
    by_spacing = bool(spectra.attrs.get(dims.NAMED_BY_SPACING))
    recorded = recorded_in(spectra)
    if style == "paper":
        return [
            shown_for([(letter, speed) for speed in SPEEDS], recorded, by_spacing)
            for letter in LETTERS_SHOWN
        ]
    speeds = sorted({speed for _, speed in recorded})
    speeds = list(SPEEDS) if set(SPEEDS) <= set(speeds) else spread(speeds, MOST_SPEEDS)
    textures = list(speeds_of_textures(recorded))
    names = texture_names(textures, by_spacing)
    return [
        [Shown(texture, speed, names[texture]) for speed in speeds]
        for texture in example_textures(textures, by_spacing)
    ]


@styled
def spectra_figure(spectra: Samples, source: str, style: Figures = "report") -> Figure:
    """Draw a grid of spectra: a row for each texture, a column for each speed.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    style
        `report` gives each texture its own scale of amplitude, `paper` all of them one.
    """
    rows, one_scale = shown_spectra(spectra, style), style == "paper"
    title = "Figure 12. Vibration spectra, one window and the mean over windows"
    figure = new_figure(1.7 * len(rows[0]) + 0.9, 1.5 * len(rows) + 0.9, title, source)
    grid = figure.subplots(
        len(rows), len(rows[0]), squeeze=False, sharex=True, sharey=True if one_scale else "row"
    )
    every: list[xr.DataArray] = []
    for cells, row in zip(grid, rows, strict=True):
        drawn = [
            line
            for axes, shown in zip(cells, row, strict=True)
            for line in _draw_panel(axes, spectra, shown)
        ]
        every += drawn
        cells[0].set_ylim(0, amplitude_top(every if one_scale else drawn))
        cells[0].set_ylabel(row[0].name, fontweight="bold", fontsize=8)
        for axes, shown in zip(cells, row, strict=True):
            wanted = f" (for {shown.wanted})" if shown.wanted else ""
            if row is rows[0] or wanted:
                axes.set_title(f"{key_of(shown.speed_mm_s)} mm/s{wanted}", fontweight="bold")
    grid[0, 0].set_xlim(0, min(HIGHEST_HZ, float(spectra[dims.FREQUENCY].max())))
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    first = next(axes for axes in grid.flat if axes.lines)
    first.legend(loc="upper right", fontsize=7.5)
    said = "one scale for all" if one_scale else "each texture its own scale"
    figure.supylabel(f"{amplitude_label(spectra.attrs)}, {said}", fontsize=8.5)
    return figure


def _draw_panel(axes: Axes, spectra: Samples, shown: Shown) -> list[xr.DataArray]:
    """Draw the middle window's first channel over the mean, and return both; neither of none."""
    windows = in_condition(spectra, shown.texture, shown.speed_mm_s)
    if not len(windows):
        axes.text(0.5, 0.5, "not recorded", color=GREY, ha="center", va="center",
                  transform=axes.transAxes)  # fmt: skip
        return []
    mean, window = mean_spectrum(windows), windows[len(windows) // 2]
    window = window.isel({name: 0 for name in window.dims if name != dims.FREQUENCY})
    axes.plot(mean[dims.FREQUENCY], mean, color=ORANGE, lw=1.6, label="mean over windows")
    axes.plot(window[dims.FREQUENCY], window, color=INK, lw=0.5, label="one window")
    return [mean, window]

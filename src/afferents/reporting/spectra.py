"""Figures 7 and 12: spectra on their true frequency axis, and one stretched to other speeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples, textures_of
from afferents.reporting.choice import (
    Shown,
    example_textures,
    in_condition,
    shown_for,
    speeds_of,
    spread,
)
from afferents.reporting.labels import speed_key, texture_names
from afferents.reporting.style import BLUE, GREY, INK, ORANGE, VERMILION, new_figure, styled
from afferents.store.recording import spacing_mm

# What Figures 7 and 12 share: one mean spectrum a condition, on its true frequency axis.
#
# The paper's Figure 12 draws 400 bins of 1 Hz against 0 to 200 Hz and labels four of its five
# speeds wrongly. Here frequency and speed are the coordinates that the spectra carry.

HIGHEST_HZ = 400.0
"""Figures show at most 0 to 400 Hz: what the paper's Figure 12 truly shows."""


def condition_spectrum(spectra: Samples, texture: str, speed_mm_s: float) -> xr.DataArray | None:
    """Return the mean spectrum of a condition over its windows and channels.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.

    Returns
    -------
    Spectrum with the dim `frequency` and the attribute `n_windows`; None where the condition
    has no sample.
    """
    windows = in_condition(spectra, texture, speed_mm_s)
    n = windows.sizes[dims.SAMPLE]
    if n == 0:
        return None
    mean = windows.mean([dim for dim in windows.dims if dim != dims.FREQUENCY])
    return mean.assign_attrs({**spectra.attrs, "n_windows": n})


def amplitude_label(attrs: Mapping[object, object]) -> str:
    """Return the name of the amplitude axis, with its unit where the spectra carry one."""
    return f"amplitude ({attrs[dims.UNITS]})" if attrs.get(dims.UNITS) else "amplitude"


def amplitude_top(spectra: Sequence[xr.DataArray | None]) -> float:
    """Return the top of an amplitude axis for these spectra; None is passed over.

    Offset and drift, the lowest hundredth of what is shown, do not set it.
    """
    tops = [float(_shown(spectrum).max()) for spectrum in spectra if spectrum is not None]
    highest = max(tops, default=1.0)
    return 1.08 * highest if highest > 0 else 1.0


def _shown(spectrum: xr.DataArray) -> xr.DataArray:
    axis = spectrum[dims.FREQUENCY]
    highest = min(HIGHEST_HZ, float(axis.max()))
    return spectrum.where((axis >= 0.01 * highest) & (axis <= highest))


def frequencies(spectrum: NDArray[np.float32], like: xr.DataArray) -> NDArray[np.float64]:
    """Return the frequencies of bins spaced as those of `like`, for a spectrum of any length."""
    axis = np.asarray(like[dims.FREQUENCY].values, dtype=np.float64)
    spacing = float(axis[1] - axis[0])
    return float(axis[0]) + spacing * np.arange(len(spectrum), dtype=np.float64)


# Figure 7: a spectrum stretched to half and twice its speed, beside the real ones.
#
# Sliding twice as fast doubles the frequency of what a texture does to the skin, so a spectrum
# stretched by two should look like one recorded at twice the speed. The paper shows texture i at
# 40 mm/s, stretched by 0.5 and 2, beside its real spectra at 20 and 80 mm/s.

FACTORS = (0.5, 2.0)
SPACING_MM, SPEED = 4.0, 40.0
"""The example of the paper: texture i (4 mm) at 40 mm/s."""

STRETCHED_TO_HZ = 200.0
"""The networks see 0 to 200 Hz; above that there is little to compare."""


@dataclass(frozen=True)
class StretchExample:
    """A texture at a speed, at half of it and at twice, each a mean spectrum (frequency).

    `name` is what the report calls the texture.
    `middle` is what is to be stretched by `FACTORS`; `half` and `double` are what the results
    should look like.
    """

    texture: str
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
    names = texture_names(textures_of(spectra), spectra.attrs)
    # Of many recordings, looking for each in all samples would take longer than all the rest.
    recorded = set(zip(spectra[dims.TEXTURE].values, spectra[dims.SPEED].values, strict=True))
    candidates = [
        (texture, float(speed))
        for texture, speed in recorded
        if {(texture, k * speed) for k in (0.5, 2.0)} <= recorded
    ]
    for texture, speed in sorted(candidates, key=_unlike_the_paper):
        found = [condition_spectrum(spectra, texture, k * speed) for k in (0.5, 1.0, 2.0)]
        half, middle, double = found
        if half is not None and middle is not None and double is not None:
            return StretchExample(texture, names[texture], speed, half, middle, double)
    return None


def _unlike_the_paper(condition: tuple[str, float]) -> tuple[int, float, float, str, float]:
    """Sort key: bumps, then words, then smooth; of each the nearest speed and spacing first."""
    texture, speed = condition
    spacing = spacing_mm(texture)
    kind = 1 if spacing is None else 0 if spacing > 0 else 2
    off = abs((spacing or 0.0) - SPACING_MM)
    return (kind, abs(speed - SPEED), off, texture, speed)


@styled
def figure07(
    example: StretchExample, stretched: Mapping[float, NDArray[np.float32]], source: str
) -> Figure:
    """Draw the spectrum, and its stretched copies over the real spectra.

    Parameters
    ----------
    example
        From `stretch_example`.
    stretched
        `example.middle` stretched by each of `FACTORS` by rebinning, as under the nested
        protocol; 1-D, any length, bins spaced as before.
    source
        The line that says what the spectra were made from.
    """
    title = (
        f"Figure 7. Stretched (nested protocol: rebinned) and real spectra, texture {example.name}"
    )
    figure = new_figure(7.6, 5.6, title, source)
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    _draw_real(upper, example.half, example.speed_mm_s / 2)
    _draw_stretched(upper, stretched[0.5], 0.5, example)
    _draw_real(middle, example.middle, example.speed_mm_s)
    _draw_real(lower, example.double, example.speed_mm_s * 2)
    _draw_stretched(lower, stretched[2.0], 2.0, example)
    lower.set_xlabel("frequency (Hz)")
    middle.set_ylabel(amplitude_label(example.middle.attrs))
    lower.set_xlim(0, min(STRETCHED_TO_HZ, float(example.middle[dims.FREQUENCY].max())))
    for axes in (upper, middle, lower):
        axes.set_ylim(0, _top(axes))
        axes.legend(loc="upper right")
    return figure


def _top(axes: Axes) -> float:
    """Return the top of an amplitude axis; offset and drift, the lowest hundredth, don't set it."""
    shown = [
        y[(x >= 0.01 * STRETCHED_TO_HZ) & (x <= STRETCHED_TO_HZ)]
        for x, y in (np.transpose(line.get_xydata()) for line in axes.lines)
    ]
    highest = max(float(y.max()) for y in shown if len(y))
    return 1.15 * highest if highest > 0 else 1.0


def _draw_real(axes: Axes, spectrum: xr.DataArray, speed_mm_s: float) -> None:
    label = f"recorded at {speed_key(speed_mm_s)} mm/s ({spectrum.attrs['n_windows']} windows)"
    axes.plot(spectrum[dims.FREQUENCY], spectrum, color=INK, lw=0.9, label=label)


def _draw_stretched(
    axes: Axes, spectrum: NDArray[np.float32], factor: float, example: StretchExample
) -> None:
    axes.plot(
        frequencies(spectrum, example.middle),
        spectrum,
        color=BLUE if factor < 1 else VERMILION,
        label=f"{speed_key(example.speed_mm_s)} mm/s stretched by {factor:g}",
    )


# Figure 12: spectra of several textures at several speeds, on the true frequency axis.

SPEEDS = (20.0, 40.0, 50.0, 80.0, 100.0)
"""What the paper's figure truly shows; its labels say 10, 30, 50, 70, 90."""
MOST_SPEEDS = 5


@styled
def figure12(spectra: Samples, source: str) -> Figure:
    """Draw a grid of mean spectra: a row for each texture, a column for each speed.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    """
    textures, speeds = example_textures(spectra), _speeds(spectra)
    names = texture_names(textures_of(spectra), spectra.attrs)
    figure = new_figure(
        1.85 * len(speeds) + 1, 1.25 * len(textures) + 0.9, "Figure 12. Vibration spectra", source
    )
    grid = figure.subplots(len(textures), len(speeds), squeeze=False, sharex=True, sharey="row")
    for texture, row in zip(textures, grid, strict=True):
        for speed, axes in zip(speeds, row, strict=True):
            _draw_condition(axes, spectra, texture, speed)
        top = amplitude_top([condition_spectrum(spectra, texture, speed) for speed in speeds])
        row[0].set_ylim(0, top)
        row[0].set_ylabel(names[texture], fontweight="bold", fontsize=8)
    for speed, axes in zip(speeds, grid[0], strict=True):
        axes.set_title(f"{speed_key(speed)} mm/s", fontweight="bold")
    highest = min(HIGHEST_HZ, float(spectra[dims.FREQUENCY].max()))
    grid[0, 0].set_xlim(0, highest)
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
    figure.supylabel(f"{amplitude_label(spectra.attrs)}, mean over windows", fontsize=8.5)
    return figure


def _draw_condition(axes: Axes, spectra: Samples, texture: str, speed: float) -> None:
    spectrum = condition_spectrum(spectra, texture, speed)
    if spectrum is None:
        axes.text(
            0.5,
            0.5,
            "not recorded",
            color=GREY,
            ha="center",
            va="center",
            transform=axes.transAxes,
        )
        return
    axes.fill_between(spectrum[dims.FREQUENCY], spectrum, color=BLUE, alpha=0.15, lw=0)
    axes.plot(spectrum[dims.FREQUENCY], spectrum, color=BLUE, lw=0.8)


def _speeds(spectra: Samples) -> list[float]:
    speeds = speeds_of(spectra)
    return list(SPEEDS) if set(SPEEDS) <= set(speeds) else spread(speeds, MOST_SPEEDS)


# Figure 12 as drawn: the spectrum of a single window, with the mean over windows behind it.
#
# Rows are the textures a, g and m, columns the speeds that the paper's figure truly shows. As in
# the paper, all panels have one scale of amplitude; where one texture is much louder than another
# that hides the others, so a second figure gives each texture its own. The frequency axis is in
# true Hz: the paper's is off by a factor of two, and four of its five speeds are labelled wrongly.

LETTERS_SHOWN = ("a", "g", "m")


def shown_spectra(spectra: Samples) -> list[list[Shown]]:
    """Choose the panels: a row for each texture, a column for each speed."""
    pairs = zip(spectra[dims.TEXTURE].values.tolist(), spectra[dims.SPEED].values, strict=True)
    recorded = sorted({(texture, float(speed)) for texture, speed in pairs})
    return [
        shown_for([(letter, speed) for speed in SPEEDS], recorded, spectra.attrs)
        for letter in LETTERS_SHOWN
    ]


@styled
def spectra_figure(spectra: Samples, source: str, one_scale: bool = True) -> Figure:
    """Draw the grid of spectra.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    one_scale
        Whether all panels have one scale of amplitude, or each texture its own.
    """
    rows = shown_spectra(spectra)
    title = "Figure 12. Vibration spectra, one window and the mean over windows"
    figure = new_figure(9.4, 5.4, title, source)
    grid = figure.subplots(
        len(rows), len(rows[0]), squeeze=False, sharex=True, sharey=True if one_scale else "row"
    )
    for cells, row in zip(grid, rows, strict=True):
        for axes, shown in zip(cells, row, strict=True):
            _draw(axes, spectra, shown)
        cells[0].set_ylabel(row[0].name, fontweight="bold", rotation=0, labelpad=10)
    grid[0, 0].set_xlim(0, min(HIGHEST_HZ, float(spectra[dims.FREQUENCY].max())))
    for cells, row in zip(grid, rows, strict=True):
        drawn = [one for each in rows for one in each] if one_scale else row
        cells[0].set_ylim(0, amplitude_top([x for one in drawn for x in _both(spectra, one)]))
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    scale = "one scale for all" if one_scale else "each texture its own scale"
    figure.supylabel(f"{amplitude_label(spectra.attrs)}, {scale}", fontsize=8.5)
    grid[0, 0].legend(loc="upper right", fontsize=7.5)
    return figure


def single_window(spectra: Samples, shown: Shown) -> Samples:
    """Return the window in the middle of a condition, of its first channel: (frequency,)."""
    windows = in_condition(spectra, shown.texture, shown.speed_mm_s)
    middle = windows.isel({dims.SAMPLE: windows.sizes[dims.SAMPLE] // 2})
    return middle.isel({name: 0 for name in middle.dims if name != dims.FREQUENCY})


def _both(spectra: Samples, shown: Shown) -> tuple[Samples, xr.DataArray | None]:
    mean = condition_spectrum(spectra, shown.texture, shown.speed_mm_s)
    return single_window(spectra, shown), mean


def _draw(axes: Axes, spectra: Samples, shown: Shown) -> None:
    window, mean = _both(spectra, shown)
    assert mean is not None  # `shown_for` takes only what was recorded
    frequency = window[dims.FREQUENCY]
    axes.plot(frequency, window, color=INK, lw=0.5, label="one window", zorder=3)
    axes.plot(frequency, mean, color=ORANGE, lw=1.6, label="mean over windows")
    wanted = f" (for {shown.wanted})" if shown.wanted else ""
    axes.set_title(f"{speed_key(shown.speed_mm_s)} mm/s{wanted}")

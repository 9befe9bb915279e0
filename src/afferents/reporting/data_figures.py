"""Figures of the data: tactile images (Figures 8 and 10) and spectra of vibration (7 and 12)."""

from collections.abc import Iterator, Sequence

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
from afferents.reporting import data, draw, labels, style
from afferents.reporting.labels import caption
from afferents.reporting.style import BLUE, GREY, INK, ORANGE, VERMILION, ReportFigure, styled
from afferents.store.recording import spacing_mm

_LEFT, _RIGHT, _TOP, _BOTTOM = (0.15, 0.5), (0.85, 0.5), (0.5, 0.85), (0.5, 0.15)
_ARROWS = {
    "+x": (_RIGHT, _LEFT), "-x": (_LEFT, _RIGHT), "+y": (_BOTTOM, _TOP), "-y": (_TOP, _BOTTOM)
}  # fmt: skip
"""Tip and tail of sliding directions in the image, in parts of it: x to the right, y downwards."""
SPACING_MM, STRETCHED_MM_S = 4.0, 40.0
"""The paper's example of a stretched spectrum: texture i (4 mm) at 40 mm/s."""
STRETCHED_TO_HZ = 200.0
"""The networks see 0 to 200 Hz; above that there is little to compare."""
SPECTRA_MM_S = (20.0, 40.0, 50.0, 80.0, 100.0)
"""What the paper's Figure 12 truly shows; its labels say 10, 30, 50, 70, 90."""
MOST_SPEEDS = 5
LETTERS_SHOWN = ("a", "g", "m")
"""Textures of the paper's Figure 12."""


def picture_images(shown: data.FigureData, source: str, figures: Figures) -> Iterator[ReportFigure]:
    """Draw Figures 8 and 10, with frames in a row, and as the paper has them also 20 apart."""
    printed = figures == "paper"
    for (channel, apart), rows in shown.frames.items():
        unit = rows[0].unit
        part = "cell" if unit.startswith(dims.GREY_LEVELS) else "marker"
        number, response = {
            dims.SA1: (8, f"How far each {part} is from rest, {unit}"),
            dims.RA1: (10, f"Change of SA-I of each {part}, {unit}"),
        }[channel]
        name, title = f"figure{number:02}", f"Figure {number}. {draw.NAMES[channel]} tactile images"
        frames = "frames in a row"
        if printed:
            frames, suffix, why = {
                20: ("frames 20 apart", "20-apart",
                     "as the paper's code draws them (its caption says 10)"),
                1: (frames, "in-a-row", "as the paper's text has them"),
            }[apart]  # fmt: skip
            name, title, frames = f"paper-{name}-{suffix}", f"{title}, {frames}", f"{frames}, {why}"
        instead = data.describe_substitutes(row.shown for row in rows)
        yield ReportFigure(
            name,
            title,
            caption("images", response, part, instead, frames, shown.began, printed),
            f"Rows of ten {draw.NAMES[channel]} tactile images, a row for each texture and speed.",
            images_figure(rows, channel, title, source, shown.sliding, one_scale=printed),
        )


@styled
def images_figure(
    rows: Sequence[data.FrameRow],
    channel: str,
    title: str,
    source: str,
    sliding: str = "",
    one_scale: bool = False,
) -> Figure:
    """Draw ten frames of each recording, one after the other, as the paper does.

    The paper speaks of ten consecutive frames; its code draws frames that are 20 apart: see
    `data.SPACINGS`. Its scale was taken from other frames and hides some. Every image has row (rank
    of the marker in y) downwards and column (rank in x) to the right, as the camera sees the skin;
    the paper's pictures are the transpose.

    Parameters
    ----------
    rows
        Those of panel A, then those of panel B; of short recordings with fewer frames.
    channel
        `sa1` or `ra1`.
    title
        Of the figure.
    source
        The line that says what the images were made from.
    sliding
        Direction in which the surface slides under the skin, such as `+x`; x is to the right, y
        downwards. Empty where nothing declares it: no arrow is drawn.
    one_scale
        Whether all rows have one scale of colours, from the 1st to the 99th percentile, or each its
        own: on one scale the texture that drags the skin farthest leaves the others dark.
    """
    n_columns = max(len(row.images) for row in rows)
    width = 0.86 * n_columns + (1.5 if one_scale else 2.1)
    figure = style.new_figure(width, 0.97 * len(rows) + 0.95, title, source)
    grid = figure.subplots(len(rows), n_columns, squeeze=False)
    panel = ""
    for cells, row in zip(grid, rows, strict=True):
        scale = draw.find_scale(*(one.images for one in (rows if one_scale else [row])))
        for axes, image, time in zip(cells, row.images, row.time_s, strict=False):
            name = f"{1000 * time:+.0f} ms" if row is rows[0] else ""
            drawn = draw.draw_image(axes, image, scale, name)
        for axes in cells[len(row.images) :]:  # the recording is too short for ten frames
            axes.set_axis_off()
        cells[0].set_ylabel(row.shown.label, rotation=0, ha="right", va="center", fontsize=8)
        if row.panel != panel:
            panel = row.panel
            cells[0].annotate(
                panel, xy=(0, 1), xytext=(-46, 4), xycoords="axes fraction",
                textcoords="offset points", fontsize=10, fontweight="bold", color=INK,
            )  # fmt: skip
        if not one_scale:
            bar = style.add_bar(
                figure, drawn, cells, "", extend="both", fraction=0.011, pad=0.011, aspect=9
            )
            bar.set_label(f"{draw.NAMES[channel]} ({row.unit})", fontsize=7)
            bar.locator = MaxNLocator(3)
    _name_axes(grid[-1, len(rows[-1].images) - 1], sliding)
    if one_scale:
        label = f"{draw.NAMES[channel]} ({rows[0].unit}), one scale for all"
        style.add_bar(
            figure, drawn, grid, label, extend="both", fraction=0.016, pad=0.012, aspect=32
        )
    return figure


def _name_axes(axes: Axes, sliding: str) -> None:
    """Name the axes of one image, and draw the sliding direction, if known, over it."""
    slides = f"\nsliding {sliding}" if sliding else ""
    axes.set_xlabel(f"column (x) →{slides}", fontsize=7)
    axes.yaxis.set_label_position("right")
    axes.set_ylabel("← row (y)", fontsize=7)
    if sliding in _ARROWS:
        tip, tail = _ARROWS[sliding]
        arrow = {"arrowstyle": "->", "color": VERMILION, "lw": 1.6}
        axes.annotate("", tip, tail, xycoords="axes fraction", arrowprops=arrow)


def picture_spectra(
    shown: data.FigureData, source: str, figures: Figures
) -> Iterator[ReportFigure]:
    """Draw Figure 7, where some texture has a speed, its half and its double, and Figure 12."""
    spectra, printed = shown.spectra, figures == "paper"
    if spectra is None:
        return
    example = choose_stretch(spectra)
    if example is not None:
        yield ReportFigure(
            "figure07",
            "Figure 7. Stretching a spectrum to another speed",
            caption("stretch"),
            "Three panels of amplitude against frequency: half the speed, the speed, twice it.",
            stretch_figure(spectra, *example, source),
        )
    by_spacing = bool(spectra.attrs.get(dims.NAMED_BY_SPACING))
    chosen = choose_spectra(spectra, figures)
    instead = data.describe_substitutes(one for row in chosen for one in row)
    yield ReportFigure(
        "paper-" * printed + "figure12",
        "Figure 12. Vibration spectra",
        caption("spectra", instead, by_spacing, printed),
        "Grid of vibration spectra, amplitude against frequency in hertz.",
        spectra_figure(spectra, source, figures),
    )


def mean_spectrum(windows: Samples) -> xr.DataArray:
    """Return the mean over windows and channels, of (sample, channel, frequency)."""
    return windows.mean([dim for dim in windows.dims if dim != dims.FREQUENCY])


def choose_stretch(spectra: Samples) -> tuple[str, float] | None:
    """Choose texture and speed (mm/s) for Figure 7: the paper's where it is there, else another.

    Bumpy textures come first, since a smooth one has no lines that stretching could move; then the
    speed nearest 40 mm/s whose half and double were recorded; then the spacing nearest 4 mm.

    Returns
    -------
    None where no texture has a speed together with its half and its double.
    """

    def unlike_the_paper(condition: tuple[str, float]) -> tuple[int, float, float, str, float]:
        texture, speed = condition
        spacing = spacing_mm(texture)
        kind = 1 if spacing is None else 0 if spacing > 0 else 2  # bumps, then words, then smooth
        off = abs((spacing or 0.0) - SPACING_MM)
        return (kind, abs(speed - STRETCHED_MM_S), off, texture, speed)

    # Of many recordings, looking for each in all samples would take longer than all the rest.
    recorded = data.list_recorded(spectra)
    candidates = [
        (texture, speed)
        for texture, speed in recorded
        if {(texture, k * speed) for k in (0.5, 2.0)} <= recorded
    ]
    return min(candidates, key=unlike_the_paper, default=None)


@styled
def stretch_figure(spectra: Samples, texture: str, speed_mm_s: float, source: str) -> Figure:
    """Draw a mean spectrum, and its copies stretched to half and twice the speed over real ones.

    Sliding twice as fast doubles the frequency of what a texture does to the skin, so a spectrum
    stretched by two should look like one recorded at twice the speed. The paper shows texture i at
    40 mm/s, stretched by 0.5 and 2, and its real spectra at 20 and 80 mm/s.

    Parameters
    ----------
    texture, speed_mm_s
        From `choose_stretch`.
    source
        The line that says what the spectra were made from.
    """
    by_spacing = bool(spectra.attrs.get(dims.NAMED_BY_SPACING))
    name = labels.texture_names(list_textures(spectra), by_spacing)[texture]
    title = f"Figure 7. Stretched (nested protocol: rebinned) and real spectra, texture {name}"
    figure = style.new_figure(7.6, 5.6, title, source)
    middle = mean_spectrum(data.select_condition(spectra, texture, speed_mm_s))
    panels = figure.subplots(3, 1, sharex=True)
    colours = {0.5: BLUE, 1: INK, 2: VERMILION}
    for axes, (factor, colour) in zip(panels, colours.items(), strict=True):
        windows = data.select_condition(spectra, texture, factor * speed_mm_s)
        real = mean_spectrum(windows)
        label = f"recorded at {key_of(factor * speed_mm_s)} mm/s ({len(windows)} windows)"
        axes.plot(real[dims.FREQUENCY], real, color=INK, lw=0.9, label=label)
        drawn = [real]
        if factor != 1:
            copy = stretch_spectrum(middle.to_numpy(), factor)  # rebinned; bins as before
            first, second = middle[dims.FREQUENCY].values[:2].astype(np.float64)
            frequency = first + (second - first) * np.arange(len(copy))
            drawn.append(xr.DataArray(copy, {dims.FREQUENCY: frequency}))
            label = f"{key_of(speed_mm_s)} mm/s stretched by {factor:g}"
            axes.plot(frequency, copy, color=colour, label=label)
        axes.set_ylim(0, draw.amplitude_top(drawn, STRETCHED_TO_HZ))
        axes.legend(loc="upper right")
    panels[-1].set_xlabel("frequency (Hz)")
    panels[1].set_ylabel(draw.amplitude_label(spectra.attrs))
    panels[-1].set_xlim(0, min(STRETCHED_TO_HZ, float(middle[dims.FREQUENCY].max())))
    return figure


def choose_spectra(spectra: Samples, figures: Figures) -> list[list[data.Shown]]:
    """Choose the panels of Figure 12: a row for each texture, a column for each speed."""
    by_spacing = bool(spectra.attrs.get(dims.NAMED_BY_SPACING))
    recorded = data.list_recorded(spectra)
    if figures == "paper":
        return [
            data.choose_substitutes([(letter, v) for v in SPECTRA_MM_S], recorded, by_spacing)
            for letter in LETTERS_SHOWN
        ]
    speeds = sorted({speed for _, speed in recorded})
    of_paper = set(SPECTRA_MM_S) <= set(speeds)
    speeds = list(SPECTRA_MM_S) if of_paper else data.spread(speeds, MOST_SPEEDS)
    textures = list(data.group_speeds(recorded))
    names = labels.texture_names(textures, by_spacing)
    return [
        [data.Shown(texture, speed, names[texture]) for speed in speeds]
        for texture in data.choose_textures(textures, by_spacing)
    ]


@styled
def spectra_figure(spectra: Samples, source: str, figures: Figures = "report") -> Figure:
    """Draw a grid of spectra: a row for each texture, a column for each speed.

    A single window, as in the paper, lies over the mean. The frequency axis is in true Hz: the
    paper draws 400 bins of 1 Hz against 0 to 200 Hz, and labels four of its five speeds wrongly.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    figures
        `report` gives each texture its own scale of amplitude, since one that is much louder hides
        the others; `paper` gives all of them one.
    """
    rows, one_scale = choose_spectra(spectra, figures), figures == "paper"
    title = "Figure 12. Vibration spectra, one window and the mean over windows"
    figure = style.new_figure(1.7 * len(rows[0]) + 0.9, 1.5 * len(rows) + 0.9, title, source)
    grid = figure.subplots(
        len(rows), len(rows[0]), squeeze=False, sharex=True, sharey=True if one_scale else "row"
    )
    every: list[xr.DataArray] = []
    for cells, row in zip(grid, rows, strict=True):
        drawn = []
        for axes, shown in zip(cells, row, strict=True):
            drawn += _draw_window(axes, spectra, shown)
            wanted = f" (for {shown.wanted})" if shown.wanted else ""
            if row is rows[0] or wanted:
                axes.set_title(f"{key_of(shown.speed_mm_s)} mm/s{wanted}", fontweight="bold")
        every += drawn
        cells[0].set_ylim(0, draw.amplitude_top(every if one_scale else drawn))
        cells[0].set_ylabel(row[0].name, fontweight="bold", fontsize=8)
    grid[0, 0].set_xlim(0, min(draw.HIGHEST_HZ, float(spectra[dims.FREQUENCY].max())))
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    first = next(axes for axes in grid.flat if axes.lines)
    first.legend(loc="upper right", fontsize=7.5)
    scale = "one scale for all" if one_scale else "each texture its own scale"
    figure.supylabel(f"{draw.amplitude_label(spectra.attrs)}, {scale}", fontsize=8.5)
    return figure


def _draw_window(axes: Axes, spectra: Samples, shown: data.Shown) -> list[xr.DataArray]:
    """Draw the middle window's first channel over the mean, and return both; neither of none."""
    windows = data.select_condition(spectra, shown.texture, shown.speed_mm_s)
    if not len(windows):
        axes.text(0.5, 0.5, "not recorded", color=GREY, ha="center", va="center",
                  transform=axes.transAxes)  # fmt: skip
        return []
    mean, window = mean_spectrum(windows), windows[len(windows) // 2]
    window = window.isel({name: 0 for name in window.dims if name != dims.FREQUENCY})
    axes.plot(mean[dims.FREQUENCY], mean, color=ORANGE, lw=1.6, label="mean over windows")
    axes.plot(window[dims.FREQUENCY], window, color=INK, lw=0.5, label="one window")
    return [mean, window]

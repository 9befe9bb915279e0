"""The report's figures: grids of panels of accuracy, of confusion, of images and of spectra.

Accuracies have a panel for each model, in percent, with a line or marks for each protocol; matrices
(Figures 9, 11 and 13) one for each speed, or group, held out. Of the data there are tactile images
(Figures 8 and 10) and spectra of vibration (7 and 12).
"""

from collections.abc import Callable, Iterator, Sequence
from statistics import fmean

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from afferents import dims
from afferents.choices import Figures
from afferents.encodings.augment import stretch_spectrum
from afferents.encodings.samples import Samples, list_textures
from afferents.evaluation import metrics
from afferents.evaluation.results import Results, Summary
from afferents.folds.held_out import SPEED, key_of, order
from afferents.reporting import data, labels, published, style, tables
from afferents.reporting.labels import PROTOCOL_TITLES, caption, model_title, percent
from afferents.reporting.style import ReportFigure, styled
from afferents.store.recording import spacing_mm

Matrix = tuple[str, NDArray[np.float64]]
"""Its title, and percent[true, predicted]; NaN rows where nothing was tested."""
_COLUMNS = 3
"""Panels of accuracy in a row."""
_ASIDE = 0.012
"""Of the axis, between the intervals of both protocols."""
_LARGEST, _SMALLEST = 15.0, 1.7
"""Diameters, points, of the marks of bins that hold all samples, and hardly any."""
FIGURE_OF = {
    "sa-se": "Figure 9A",
    "sa-ste": "Figure 9B",
    "ra-se": "Figure 11A",
    "ra-ste": "Figure 11B",
    "vib-te": "Figure 13A",
    "vib-te-aug": "Figure 13B",
}
"""Where the paper shows each family's matrices."""
TWICE = ("vib-te", "vib-te-aug")
"""Models whose matrices the paper prints at twice the percentage."""
_WIDTH_INCH, _PANELS_INCH = 9.4, 7.7
"""Width of a figure of matrices, and what of it the panels of a row share."""
MANY_TEXTURES = 10
"""Of more there are three matrices a row, so that cells are large enough for their numbers."""
_PAPER_COLUMNS = 5
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


def picture_accuracies(results: Results) -> Iterator[ReportFigure]:
    """Yield the figures of accuracy that the results have."""
    if results.found.models:
        yield _picture_groups(results)
        if results.found.lengths:
            yield _picture_lengths(results)
        yield _picture_textures(results)
    if any(found.reliability for *_, found in labels.outcomes(results.found)):
        yield _picture_reliability(results)


@styled
def _picture_groups(results: Results) -> ReportFigure:
    """Draw accuracy by held-out speed, or group, with intervals; the paper's as crosses."""
    summary = results.found
    split, keys = summary.split, summary.held_out_keys
    families = published.published_families() if labels.are_published(summary) else {}
    # Groups that are no numbers stand one after the other.
    places = {key: float(key) if split.ordered else float(n) for n, key in enumerate(keys)}
    aside = _ASIDE * (max(places.values()) - min(places.values()))

    def draw_model(axes: Axes, model: str) -> None:
        style.percent_axes(axes, model_title(model, summary))
        if not split.ordered:
            style.name_places(axes, keys, len(keys), longest=4)
        if model in families:
            paper = families[model].by_speed
            there = [speed for speed in summary.speeds_mm_s if speed in paper]
            _draw_paper(axes, there, [paper[speed] for speed in there])
        for protocol, found in labels.outcomes_by_protocol(summary, model).items():
            at = [places[key] for key in found.by]
            style.draw_accuracies(axes, protocol, at, [*found.by.values()], "-" * split.ordered)
            # Both protocols' bars would hide each other: the second's stand to the right.
            shifted = [x + aside * (protocol == "published") for x in at]
            _draw_intervals(axes, protocol, shifted, list(found.ci95_by.values()))
        _draw_intervals_key(axes)
        style.draw_chance(axes, summary.chance)

    return _picture_panels(
        results, f"accuracy-by-{split.leaks}", f"Accuracy by held-out {split.title}",
        caption("accuracy_by_group", summary),
        f"Line chart of accuracy in percent against held-out {split.title}, a panel for each "
        "model. The same numbers stand in a table below.",
        labels.list_models(summary), draw_model, f"held-out {split.axis}",
    )  # fmt: skip


@styled
def _picture_textures(results: Results) -> ReportFigure:
    """Draw accuracy by texture, the paper's as crosses."""
    textures, summary = results.textures, results.found
    names = list(labels.texture_names(textures, summary.named_by_spacing).values())

    def draw_model(axes: Axes, model: str) -> None:
        style.percent_axes(axes, model_title(model, summary), least=-3)
        for protocol in labels.outcomes_by_protocol(summary, model):
            found = tables.accuracy_by_texture(results, model, protocol)
            at, shares = [textures.index(t) for t in found], [v / 100 for v in found.values()]
            style.draw_accuracies(axes, protocol, at, shares, "-", width=0.8)
        if of_paper := tables.paper_by_texture(results, model):
            _draw_paper(axes, range(len(textures)), of_paper)
        style.draw_chance(axes, summary.chance)
        style.name_places(axes, names, style.MOST_TICKS)

    axis = labels.texture_axis(textures, summary.named_by_spacing)
    return _picture_panels(
        results, "accuracy-by-texture", "Accuracy by texture",
        caption("accuracy_by_texture", summary),
        "Chart of accuracy in percent against texture, a panel for each model. The same "
        "numbers stand in a table above.",
        labels.list_models(summary), draw_model, axis, height=1.9,
    )  # fmt: skip


@styled
def _picture_lengths(results: Results) -> ReportFigure:
    """Draw accuracy against the length of the window, with intervals."""
    summary = results.found

    def draw_model(axes: Axes, base: str) -> None:
        style.percent_axes(axes, model_title(base, summary))
        axes.set_xscale("log")
        axes.set_xticks([int(n) for n in summary.lengths[base]], list(summary.lengths[base]))
        axes.minorticks_off()
        for protocol in PROTOCOL_TITLES:
            if found := tables.outcomes_by_length(summary, base, protocol):
                at, ones = [int(n) for n in found], found.values()
                style.draw_accuracies(axes, protocol, at, [one.mean_accuracy for one in ones], "-")
                _draw_intervals(axes, protocol, at, [one.ci95 for one in ones])
        _draw_intervals_key(axes)
        style.draw_chance(axes, summary.chance)

    return _picture_panels(
        results, "accuracy-by-length", "Accuracy by length of window",
        caption("accuracy_by_length", summary),
        "Line chart of accuracy in percent against frames of a window, a panel for each model. "
        "The same numbers stand in the table above.",
        list(summary.lengths), draw_model, "frames of a window",
    )  # fmt: skip


@styled
def _picture_reliability(results: Results) -> ReportFigure:
    """Draw accuracy against confidence, a mark a bin; the calibration error stands above.

    The area of a mark is the bin's share of the samples.
    """
    summary = results.found

    def draw_model(axes: Axes, model: str) -> None:
        axes.set_title(model_title(model, summary), loc="left", fontweight="bold")
        ticks = range(0, 101, 20)
        axes.set(xlim=(-3, 107), ylim=(-5, 107), xticks=ticks, yticks=ticks)
        axes.grid(color=style.LINE, lw=0.4)
        axes.plot([0, 100], [0, 100], color=style.GREY, lw=0.8, ls=(0, (4, 3)),
                  label="as often as it says")  # fmt: skip
        errors = []
        for protocol, found in labels.outcomes_by_protocol(summary, model).items():
            if (bins := found.reliability) is None:
                continue
            count = np.array(bins.count)
            filled = count > 0
            x, y = (100 * np.array(each)[filled] for each in (bins.confidence, bins.accuracy))
            area = np.maximum(_LARGEST**2 * count[filled] / count.sum(), _SMALLEST**2)
            colour, marker = style.PROTOCOL_COLOURS[protocol], "o" if protocol == "nested" else "s"
            filling = colour if protocol == "nested" else "white"
            axes.scatter(x, y, s=area, c=filling, edgecolors=colour, linewidths=0.8, marker=marker,
                         zorder=3, alpha=0.85)  # fmt: skip
            axes.plot([], [], color=colour, ls="", marker=marker, markerfacecolor=filling,
                      markersize=5, label=PROTOCOL_TITLES[protocol])  # fmt: skip
            errors.append(percent(bins.ece))
        if errors:
            title = f"ECE {' and '.join(errors)}%"
            axes.set_title(title, loc="right", fontsize=7.5, color=style.GREY)

    return _picture_panels(
        results, "reliability", "Right as often as it says?",
        caption("reliability", summary),
        "Chart of accuracy against confidence, both in percent, a panel for each model. The "
        "calibration errors stand in the table above.",
        labels.list_models(summary), draw_model, "confidence (%)", height=2.5,
    )  # fmt: skip


def _picture_panels(
    results: Results,
    name: str,
    title: str,
    text: str,
    description: str,
    panels: Sequence[str],
    draw_panel: Callable[[Axes, str], None],
    axis: str,
    height: float = 2.1,
) -> ReportFigure:
    """Return a figure of accuracies: a panel for each model, below a row with the legend of all.

    `axis` is what accuracy goes with, `height` that of a panel, inches.
    """
    n_columns = min(_COLUMNS, len(panels))
    n_rows = -(-len(panels) // n_columns)
    size = max(3.0 * n_columns + 0.5, 6.0), height * n_rows + 1.0
    figure = style.new_figure(*size, title, labels.source_line(results.found))
    heading, *rows = figure.subplots(
        n_rows + 1, n_columns, squeeze=False, sharex=True, sharey=True,
        gridspec_kw={"height_ratios": [0.08, *[1.0] * n_rows]},
    )  # fmt: skip
    grid = np.array(rows)
    for axes, panel in zip(grid.flat, panels, strict=False):
        draw_panel(axes, panel)
    style.hide(list(grid.flat)[len(panels) :])
    for column in grid.T:
        lowest = [axes for axes in column if axes.get_visible()][-1]
        lowest.set_xlabel(axis)
        lowest.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel("accuracy (%)")
    shown = [axes.get_legend_handles_labels() for axes in grid.flat[: len(panels)]]
    entries = {entry: handle for ends in shown for handle, entry in zip(*ends, strict=True)}
    for axes in heading:
        axes.set_axis_off()
    legend = heading[0].legend(
        list(entries.values()), list(entries), loc="center left", ncols=len(entries)
    )
    legend.set_in_layout(False)
    return ReportFigure(name, title, text, description, figure)


def _draw_intervals(
    axes: Axes, protocol: str, at: Sequence[float], intervals: Sequence[tuple[float, float]]
) -> None:
    low, high = 100 * np.array(intervals).T
    axes.vlines(at, low, high, color=style.PROTOCOL_COLOURS[protocol], lw=2.2, alpha=0.35)


def _draw_intervals_key(axes: Axes) -> None:
    axes.plot([], [], color=style.GREY, lw=2.2, alpha=0.5, label="95% interval")


def _draw_paper(axes: Axes, at: Sequence[float], accuracies: Sequence[float]) -> None:
    """Draw the paper's own accuracies, percent."""
    axes.plot(at, accuracies, color=style.GREY, ls="", marker="x", markersize=4,
              label="paper, its own recordings")  # fmt: skip


def picture_matrices(results: Results, figures: Figures) -> Iterator[ReportFigure]:
    """Draw the confusion matrices of every model and protocol."""
    summary = results.found
    for model, protocol, found in labels.outcomes(summary):
        printed = figures == "paper" and is_in_paper(model, summary)
        figure = confusion_figure(results, model, protocol, "paper" if printed else "report")
        if figure is None:
            continue
        title = _name_matrices(model, protocol, summary)
        text = caption("confusion", summary, style.LEAST_WRITTEN)
        yield ReportFigure(
            f"{'paper-' * printed}confusion-{model}-{protocol}",
            title,
            caption("printed_confusion", model in TWICE) if printed else text,
            f"Confusion matrices. {title}. Mean accuracy over held-out {results.split.many} "
            f"{percent(found.mean_accuracy)} percent.",
            figure,
        )


def is_in_paper(model: str, summary: Summary) -> bool:
    """Return whether the paper has a figure of a model's matrices."""
    return model in FIGURE_OF and summary.split == SPEED


def _name_matrices(model: str, protocol: str, summary: Summary) -> str:
    """Return the number that the figure has in the paper, the model and the protocol."""
    number = f"{FIGURE_OF[model]}. " if is_in_paper(model, summary) else ""
    return f"{number}{model_title(model, summary)}, {PROTOCOL_TITLES[protocol]}"


@styled
def confusion_figure(
    results: Results, model: str, protocol: str, figures: Figures = "report"
) -> Figure | None:
    """Draw a matrix for every group held out; None if it was not evaluated.

    Parameters
    ----------
    figures
        `report` adds one over all groups, and the paper's mean matrix where textures are its own.
        `paper` draws what the model's figure in the paper has, five in a row, the first texture at
        the top left, and None of what has no such figure; of Figure 13 also as it is printed.
    """
    summary, split, textures = results.found, results.split, results.textures
    rows = results.predictions
    rows = rows[(rows["model"] == model) & (rows["protocol"] == protocol)]
    printed = figures == "paper"
    if rows.empty or (printed and not is_in_paper(model, summary)):
        return None
    groups = rows[split.column]
    panels = [
        _count(rows[groups == group], textures, split.printed(group) + " held out" * (not printed))
        for group in sorted(groups.unique().tolist(), key=order)
    ]
    blocks = [("", style.OF_TRUE, panels)]
    if printed and model in TWICE:
        twice = [(title, np.minimum(2 * matrix, 100)) for title, matrix in panels]
        blocks = [("as printed: twice the percentage, at most 100", "as printed", twice),
                  ("as it should be", style.OF_TRUE, panels)]  # fmt: skip
    elif not printed:
        panels.append(_count(rows, textures, f"all held-out {split.many}"))
        if model in published.published_families() and labels.are_published(summary):
            mean = published.published_families()[model].mean_percent
            title = f"paper, its own recordings: {mean}%"
            panels.append((title, published.published_confusion(model)))
    n = len(panels)
    n_columns = min(_PAPER_COLUMNS, n)
    if not printed:  # 4, or 3 where that leaves fewer empty or textures are many
        fewer = n <= 3 or len(textures) > MANY_TEXTURES
        n_columns = min(3, n) if fewer else min((4, 3), key=lambda k: (-n % k, -k))
    n_rows = -(-n // n_columns)
    heading_inch, names_inch = 0.3 * (len(blocks) > 1), 0.04 * max(map(len, textures))
    block_inch = n_rows * (_PANELS_INCH / n_columns + 0.34) + heading_inch
    figure = style.new_figure(
        _WIDTH_INCH, len(blocks) * block_inch + 0.8 + names_inch,
        _name_matrices(model, protocol, summary), labels.source_line(summary),
    )  # fmt: skip
    parts = figure.subfigures(len(blocks), 1, squeeze=False)
    for part, (heading, label, shown) in zip(parts.flat, blocks, strict=True):
        part.suptitle(heading, fontsize=9, x=0.055, ha="left")
        grid = part.subplots(n_rows, n_columns, squeeze=False)
        for axes, (title, matrix) in zip(grid.flat, shown, strict=False):
            drawn = style.draw_matrix(
                axes, matrix, title, _PANELS_INCH / n_columns, "upper" if printed else "lower"
            )
        style.hide(list(grid.flat)[n:])
        style.name_textures(grid, textures, summary.named_by_spacing)
        style.add_bar(part, drawn, list(grid.flat), label, fraction=0.02, pad=0.015, aspect=30)
    return figure


def _count(rows: pd.DataFrame, textures: list[str], title: str) -> Matrix:
    accuracy = 100 * fmean(metrics.accuracy_by_group(rows).values())
    return f"{title}: {accuracy:.0f}%", style.normalise(metrics.confusion(rows, textures))


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
        name, frames = f"figure{number:02}", "frames in a row"
        title = f"Figure {number}. {style.NAMES[channel]} tactile images"
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
            f"Rows of ten {style.NAMES[channel]} tactile images, a row for each texture and speed.",
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
        scale = style.find_scale(*(one.images for one in (rows if one_scale else [row])))
        for axes, image, time in zip(cells, row.images, row.time_s, strict=False):
            name = f"{1000 * time:+.0f} ms" if row is rows[0] else ""
            drawn = style.draw_image(axes, image, scale, name)
        for axes in cells[len(row.images) :]:  # the recording is too short for ten frames
            axes.set_axis_off()
        cells[0].set_ylabel(row.shown.label, rotation=0, ha="right", va="center", fontsize=8)
        if row.panel != panel:
            panel = row.panel
            cells[0].annotate(
                panel, xy=(0, 1), xytext=(-46, 4), xycoords="axes fraction",
                textcoords="offset points", fontsize=10, fontweight="bold", color=style.INK,
            )  # fmt: skip
        if not one_scale:
            bar = style.add_bar(
                figure, drawn, cells, "", extend="both", fraction=0.011, pad=0.011, aspect=9
            )
            bar.set_label(f"{style.NAMES[channel]} ({row.unit})", fontsize=7)
            bar.locator = MaxNLocator(3)
    last = grid[-1, len(rows[-1].images) - 1]  # whose axes are named for all
    slides = f"\nsliding {sliding}" if sliding else ""
    last.set_xlabel(f"column (x) →{slides}", fontsize=7)
    last.yaxis.set_label_position("right")
    last.set_ylabel("← row (y)", fontsize=7)
    if sliding in _ARROWS:
        tip, tail = _ARROWS[sliding]
        arrow = {"arrowstyle": "->", "color": style.VERMILION, "lw": 1.6}
        last.annotate("", tip, tail, xycoords="axes fraction", arrowprops=arrow)
    if one_scale:
        label = f"{style.NAMES[channel]} ({rows[0].unit}), one scale for all"
        style.add_bar(
            figure, drawn, grid, label, extend="both", fraction=0.016, pad=0.012, aspect=32
        )
    return figure


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
    colours = {0.5: style.BLUE, 1: style.INK, 2: style.VERMILION}
    for axes, (factor, colour) in zip(panels, colours.items(), strict=True):
        windows = data.select_condition(spectra, texture, factor * speed_mm_s)
        real = mean_spectrum(windows)
        label = f"recorded at {key_of(factor * speed_mm_s)} mm/s ({len(windows)} windows)"
        axes.plot(real[dims.FREQUENCY], real, color=style.INK, lw=0.9, label=label)
        drawn = [real]
        if factor != 1:
            copy = stretch_spectrum(middle.to_numpy(), factor)  # rebinned; bins as before
            first, second = middle[dims.FREQUENCY].values[:2].astype(np.float64)
            frequency = first + (second - first) * np.arange(len(copy))
            drawn.append(xr.DataArray(copy, {dims.FREQUENCY: frequency}))
            label = f"{key_of(speed_mm_s)} mm/s stretched by {factor:g}"
            axes.plot(frequency, copy, color=colour, label=label)
        axes.set_ylim(0, style.amplitude_top(drawn, STRETCHED_TO_HZ))
        axes.legend(loc="upper right")
    panels[-1].set_xlabel("frequency (Hz)")
    panels[1].set_ylabel(style.amplitude_label(spectra.attrs))
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
        cells[0].set_ylim(0, style.amplitude_top(every if one_scale else drawn))
        cells[0].set_ylabel(row[0].name, fontweight="bold", fontsize=8)
    grid[0, 0].set_xlim(0, min(style.HIGHEST_HZ, float(spectra[dims.FREQUENCY].max())))
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    first = next(axes for axes in grid.flat if axes.lines)
    first.legend(loc="upper right", fontsize=7.5)
    scale = "one scale for all" if one_scale else "each texture its own scale"
    figure.supylabel(f"{style.amplitude_label(spectra.attrs)}, {scale}", fontsize=8.5)
    return figure


def _draw_window(axes: Axes, spectra: Samples, shown: data.Shown) -> list[xr.DataArray]:
    """Draw the middle window's first channel over the mean, and return both; neither of none."""
    windows = data.select_condition(spectra, shown.texture, shown.speed_mm_s)
    if not len(windows):
        axes.text(0.5, 0.5, "not recorded", color=style.GREY, ha="center", va="center",
                  transform=axes.transAxes)  # fmt: skip
        return []
    mean, window = mean_spectrum(windows), windows[len(windows) // 2]
    window = window.isel({name: 0 for name in window.dims if name != dims.FREQUENCY})
    axes.plot(mean[dims.FREQUENCY], mean, color=style.ORANGE, lw=1.6, label="mean over windows")
    axes.plot(window[dims.FREQUENCY], window, color=style.INK, lw=0.5, label="one window")
    return [mean, window]

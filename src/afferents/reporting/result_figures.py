"""Figures of results: accuracies, and the confusion matrices of Figures 9, 11 and 13.

Accuracies have a panel for each model, in percent, with a line or marks for each protocol; matrices
one for each speed, or group, held out.
"""

from collections.abc import Callable, Iterator, Sequence
from statistics import fmean

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.choices import Figures
from afferents.evaluation import metrics
from afferents.evaluation.results import Results, Summary
from afferents.folds.held_out import SPEED, order
from afferents.reporting import draw, labels, published, style, tables
from afferents.reporting.labels import PROTOCOL_TITLES, caption, model_title, percent
from afferents.reporting.style import GREY, LINE, ReportFigure, styled

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
            draw.draw_accuracies(axes, protocol, at, [*found.by.values()], "-" * split.ordered)
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
            draw.draw_accuracies(axes, protocol, at, shares, "-", width=0.8)
        if of_paper := tables.paper_by_texture(results, model):
            _draw_paper(axes, range(len(textures)), of_paper)
        style.draw_chance(axes, summary.chance)
        style.name_places(axes, names, draw.MOST_TICKS)

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
                draw.draw_accuracies(axes, protocol, at, [one.mean_accuracy for one in ones], "-")
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
        axes.grid(color=LINE, lw=0.4)
        axes.plot([0, 100], [0, 100], color=GREY, lw=0.8, ls=(0, (4, 3)),
                  label="as often as it says")  # fmt: skip
        errors = []
        for protocol, found in labels.outcomes_by_protocol(summary, model).items():
            if (bins := found.reliability) is None:
                continue
            count = np.array(bins.count)
            filled = count > 0
            x, y = (100 * np.array(each)[filled] for each in (bins.confidence, bins.accuracy))
            area = np.maximum(_LARGEST**2 * count[filled] / count.sum(), _SMALLEST**2)
            colour, marker = draw.PROTOCOL_COLOURS[protocol], "o" if protocol == "nested" else "s"
            filling = colour if protocol == "nested" else "white"
            axes.scatter(x, y, s=area, c=filling, edgecolors=colour, linewidths=0.8, marker=marker,
                         zorder=3, alpha=0.85)  # fmt: skip
            axes.plot([], [], color=colour, ls="", marker=marker, markerfacecolor=filling,
                      markersize=5, label=PROTOCOL_TITLES[protocol])  # fmt: skip
            errors.append(percent(bins.ece))
        if errors:
            title = f"ECE {' and '.join(errors)}%"
            axes.set_title(title, loc="right", fontsize=7.5, color=GREY)

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
    axes.vlines(at, low, high, color=draw.PROTOCOL_COLOURS[protocol], lw=2.2, alpha=0.35)


def _draw_intervals_key(axes: Axes) -> None:
    axes.plot([], [], color=GREY, lw=2.2, alpha=0.5, label="95% interval")


def _draw_paper(axes: Axes, at: Sequence[float], accuracies: Sequence[float]) -> None:
    """Draw the paper's own accuracies, percent."""
    axes.plot(at, accuracies, color=GREY, ls="", marker="x", markersize=4,
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
        text = caption("confusion", summary, draw.LEAST_WRITTEN)
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
    blocks = [("", draw.OF_TRUE, panels)]
    if printed and model in TWICE:
        twice = [(title, np.minimum(2 * matrix, 100)) for title, matrix in panels]
        blocks = [("as printed: twice the percentage, at most 100", "as printed", twice),
                  ("as it should be", draw.OF_TRUE, panels)]  # fmt: skip
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
            drawn = draw.draw_matrix(axes, matrix, title, "upper" if printed else "lower")
            draw.write_numbers(axes, matrix, _PANELS_INCH / n_columns)
        style.hide(list(grid.flat)[n:])
        draw.name_textures(grid, textures, summary.named_by_spacing)
        style.add_bar(part, drawn, list(grid.flat), label, fraction=0.02, pad=0.015, aspect=30)
    return figure


def _count(rows: pd.DataFrame, textures: list[str], title: str) -> Matrix:
    accuracy = 100 * fmean(metrics.accuracy_by_group(rows).values())
    return f"{title}: {accuracy:.0f}%", draw.normalise(metrics.confusion(rows, textures))

"""Accuracy by what was held out, by texture, by length of window, and by confidence.

Each figure has a panel for each model, in percent, with a line or marks for each protocol.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes

from afferents.evaluation.results import Reliability, Results
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    are_published,
    by_protocol,
    drawn_over,
    model_order,
    model_title,
    outcomes,
    percent,
    source_line,
    texture_axis,
    texture_names,
)
from afferents.reporting.published import published_families
from afferents.reporting.style import (
    GREY,
    LINE,
    PROTOCOL_MARKS,
    ReportFigure,
    draw_chance,
    name_places,
    panels_figure,
    percent_axes,
    styled,
)
from afferents.reporting.tables import (
    accuracy_by_texture,
    by_length,
    paper_by_texture,
    temperature_note,
)

_ASIDE = 0.012
"""Of the axis, between the intervals of both protocols."""
_MOST_NAMES = 14
"""Names of textures under an axis; of more, some are left out."""
_LARGEST, _SMALLEST = 15.0, 1.7
"""Diameters, points, of the marks of bins that hold all samples, and hardly any."""


def accuracy_pictures(results: Results) -> Iterator[ReportFigure]:
    """Yield the figures of accuracy that the results have."""
    if results.found.models:
        yield speed_picture(results)
        if results.found.lengths:
            yield lengths_picture(results)
        yield texture_picture(results)
    if any(found.reliability for *_, found in outcomes(results.found)):
        yield reliability_picture(results)


def _marks(results: Results, nested: str = "", published: str = "") -> str:
    """Return what the marks of the protocols that there are stand for."""
    there = {protocol for _, protocol, _ in outcomes(results.found)}
    filled = f"Filled: nested protocol{nested}. " if "nested" in there else ""
    return filled + (f"Open: published protocol{published}. " if "published" in there else "")


def _bars(results: Results) -> str:
    return f"Bars: 95% intervals, drawn over {drawn_over(results.found)}. "


@styled
def speed_picture(results: Results) -> ReportFigure:
    """Draw accuracy by held-out speed, or group, with intervals; the paper's as crosses."""
    summary = results.found
    split, keys = summary.split, summary.held_out_keys
    # Groups that are no numbers stand one after the other.
    places = {key: float(key) if split.ordered else float(n) for n, key in enumerate(keys)}
    aside = _ASIDE * (max(places.values()) - min(places.values()))

    def draw(axes: Axes, model: str) -> None:
        percent_axes(axes, model_title(model, summary))
        if not split.ordered:
            name_places(axes, keys, len(keys), longest=4)
        if model in published_families() and are_published(summary):
            paper = published_families()[model].by_speed
            there = [speed for speed in summary.speeds_mm_s if speed in paper]
            _draw_paper(axes, there, [paper[speed] for speed in there])
        for protocol, found in by_protocol(summary, model).items():
            at = [places[key] for key in found.by]
            _draw_line(axes, protocol, at, list(found.by.values()), "-" * split.ordered)
            # Both protocols' bars would hide each other: the second's stand to the right.
            shifted = [x + aside * (protocol == "published") for x in at]
            _draw_intervals(axes, protocol, shifted, list(found.ci95_by.values()))
        _name_intervals(axes)
        draw_chance(axes, summary.chance)

    return _picture(
        results, f"accuracy-by-{split.leaks}", f"Accuracy by held-out {split.title}",
        _marks(
            results,
            f", where nothing of the held-out {split.title} was seen",
            f", where the other half of that {split.title} picked the model",
        )
        + _bars(results)
        + "Crosses: the paper, measured on its own recordings. " * are_published(summary)
        + "The dashed line is chance.",
        f"Line chart of accuracy in percent against held-out {split.title}, a panel for each "
        "model. The same numbers stand in a table below.",
        model_order(summary), draw, f"held-out {split.axis}",
    )  # fmt: skip


@styled
def texture_picture(results: Results) -> ReportFigure:
    """Draw accuracy by texture, the paper's as crosses."""
    textures, summary = results.textures, results.found
    names = texture_names(textures, summary.named_by_spacing)

    def draw(axes: Axes, model: str) -> None:
        percent_axes(axes, model_title(model, summary), least=-3)
        for protocol in by_protocol(summary, model):
            found = accuracy_by_texture(results, model, protocol)
            at, shares = [textures.index(t) for t in found], [v / 100 for v in found.values()]
            _draw_line(axes, protocol, at, shares, "-", width=0.8)
        if of_paper := paper_by_texture(results, model):
            _draw_paper(axes, range(len(textures)), of_paper)
        draw_chance(axes, summary.chance)
        name_places(axes, list(names.values()), _MOST_NAMES)

    crosses = "Crosses: the paper, from the diagonals of its matrices. "
    return _picture(
        results, "accuracy-by-texture", "Accuracy by texture",
        f"Share of each texture's test samples recognised, mean over held-out "
        f"{results.split.many}. {_marks(results)}{crosses * are_published(summary)}"
        "The dashed line is chance.",
        "Chart of accuracy in percent against texture, a panel for each model. The same "
        "numbers stand in a table above.",
        model_order(summary), draw, texture_axis(textures, summary.named_by_spacing), height=1.9,
    )  # fmt: skip


@styled
def lengths_picture(results: Results) -> ReportFigure:
    """Draw accuracy against the length of the window, with intervals."""
    summary = results.found

    def draw(axes: Axes, base: str) -> None:
        percent_axes(axes, model_title(base, summary))
        axes.set_xscale("log")
        axes.set_xticks([int(n) for n in summary.lengths[base]], list(summary.lengths[base]))
        axes.minorticks_off()
        for protocol in PROTOCOL_TITLES:
            if found := by_length(summary, base, protocol):
                at, ones = [int(n) for n in found], found.values()
                _draw_line(axes, protocol, at, [one.mean_accuracy for one in ones], "-")
                _draw_intervals(axes, protocol, at, [one.ci95 for one in ones])
        _name_intervals(axes)
        draw_chance(axes, summary.chance)

    return _picture(
        results, "accuracy-by-length", "Accuracy by length of window",
        f"Mean over what was held out, against the frames of a window. {_marks(results)}"
        f"{_bars(results)}The dashed line is chance.",
        "Line chart of accuracy in percent against frames of a window, a panel for each model. "
        "The same numbers stand in the table above.",
        list(summary.lengths), draw, "frames of a window",
    )  # fmt: skip


@styled
def reliability_picture(results: Results) -> ReportFigure:
    """Draw accuracy against confidence; the calibration error stands above each panel."""
    summary = results.found

    def draw(axes: Axes, model: str) -> None:
        axes.set_title(model_title(model, summary), loc="left", fontweight="bold")
        ticks = range(0, 101, 20)
        axes.set(xlim=(-3, 107), ylim=(-5, 107), xticks=ticks, yticks=ticks)
        axes.grid(color=LINE, lw=0.4)
        axes.plot([0, 100], [0, 100], color=GREY, lw=0.8, ls=(0, (4, 3)),
                  label="as often as it says")  # fmt: skip
        errors = []
        for protocol, found in by_protocol(summary, model).items():
            if found.reliability:
                _draw_bins(axes, protocol, found.reliability)
                errors.append(percent(found.reliability.ece))
        if errors:
            said = f"ECE {' and '.join(errors)}%"
            axes.set_title(said, loc="right", fontsize=7.5, color=GREY)

    return _picture(
        results, "reliability", "Right as often as it says?",
        "Reliability diagram: test samples gathered by confidence, the probability of the "
        f"predicted texture, in bins of equal width. {_marks(results)}The area of a mark is "
        "its share of the samples. On the dashed line a model is right as often as it says; "
        "below it is too sure, above too modest. ECE: expected calibration error of the "
        f"protocols, in this order. {temperature_note(summary)}",
        "Chart of accuracy against confidence, both in percent, a panel for each model. The "
        "calibration errors stand in the table above.",
        model_order(summary), draw, "confidence (%)", height=2.5,
    )  # fmt: skip


def _picture(
    results: Results,
    name: str,
    title: str,
    caption: str,
    description: str,
    panels: Sequence[str],
    draw: Callable[[Axes, str], None],
    axis: str,
    height: float = 2.1,
) -> ReportFigure:
    """Return a figure with a panel for each model; see `ReportFigure` and `panels_figure`."""
    figure = panels_figure(panels, draw, title, source_line(results.found), axis, height)
    return ReportFigure(name, title, caption, description, figure)


def _draw_line(
    axes: Axes,
    protocol: str,
    at: Sequence[float],
    shares: Sequence[float],
    line: str,
    width: float = 1.1,
) -> None:
    colour, marker, filling = PROTOCOL_MARKS[protocol]
    axes.plot(
        at, 100 * np.array(shares), color=colour, ls=line, lw=width, marker=marker,
        markerfacecolor=filling, markersize=4, label=PROTOCOL_TITLES[protocol],
    )  # fmt: skip


def _draw_intervals(
    axes: Axes, protocol: str, at: Sequence[float], intervals: Sequence[tuple[float, float]]
) -> None:
    low, high = 100 * np.array(intervals).T
    axes.vlines(at, low, high, color=PROTOCOL_MARKS[protocol][0], lw=2.2, alpha=0.35)


def _name_intervals(axes: Axes) -> None:
    axes.plot([], [], color=GREY, lw=2.2, alpha=0.5, label="95% interval")


def _draw_paper(axes: Axes, at: Sequence[float], accuracies: Sequence[float]) -> None:
    """Draw the paper's own accuracies, percent."""
    axes.plot(at, accuracies, color=GREY, ls="", marker="x", markersize=4,
              label="paper, its own recordings")  # fmt: skip


def _draw_bins(axes: Axes, protocol: str, bins: Reliability) -> None:
    """Draw a mark a bin, the larger the more samples it holds: its area is their share."""
    colour, marker, filling = PROTOCOL_MARKS[protocol]
    count = np.array(bins.count)
    filled = count > 0
    x, y = (100 * np.array(each)[filled] for each in (bins.confidence, bins.accuracy))
    area = np.maximum(_LARGEST**2 * count[filled] / count.sum(), _SMALLEST**2)
    axes.scatter(x, y, s=area, c=filling, edgecolors=colour, linewidths=0.8, marker=marker,
                 zorder=3, alpha=0.85)  # fmt: skip
    axes.plot([], [], color=colour, ls="", marker=marker, markerfacecolor=filling, markersize=5,
              label=PROTOCOL_TITLES[protocol])  # fmt: skip

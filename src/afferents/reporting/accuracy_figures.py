"""Accuracy by what was held out, by texture, by length of window, and by confidence."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.evaluation.results import Results
from afferents.folds.held_out import SPEED, key_of, split_of
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
    are_published,
    drawn_over,
    groups_in,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    preset_note,
    source_line,
    texture_axis,
    texture_names,
)
from afferents.reporting.published import published_confusion, published_families
from afferents.reporting.style import (
    GREY,
    LINE,
    PROTOCOL_MARKS,
    draw_chance,
    finish_panels,
    model_panels,
    name_textures,
    percent_axes,
    styled,
)
from afferents.reporting.tables import PAPER_ROW, Cell, Table, mean_and_interval

_ASIDE = 0.012
"""Of the axis, between the intervals of both protocols."""


@styled
def speed_figure(summary: Summary) -> Figure:
    """Draw accuracy in percent by held-out speed, or group, under the protocols that were run."""
    split = split_of(summary)
    models = model_order(summary)
    title = f"Accuracy by held-out {split.name}"
    figure, heading, grid = model_panels(len(models), title, source_line(summary))
    for axes, model in zip(grid.flat, models, strict=False):
        _draw_model(axes, summary, model)
    finish_panels(heading, grid, len(models), f"held-out {split.axis}", "accuracy (%)")
    return figure


def _draw_model(axes: Axes, summary: Summary, model: str) -> None:
    percent_axes(axes, model_title(model, summary))
    split = split_of(summary)
    if split != SPEED:
        _name_groups(axes, summary)
    elif are_published(summary):
        _draw_paper(axes, summary, model)
    for protocol, title in PROTOCOL_TITLES.items():
        found = outcome(summary, model, protocol)
        if found is not None:
            line = "-" if split.ordered else ""
            _draw_protocol(axes, _points(summary, found), protocol, title, line)
            _draw_intervals(axes, summary, found, protocol)
    if axes.collections:
        axes.plot([], [], color=GREY, lw=2.2, alpha=0.5, label="95% interval")
    draw_chance(axes, summary["chance"])


def _points(summary: Summary, found: dict[str, Any]) -> list[tuple[float, float]]:
    """Return where the groups lie and percents; see `_places`."""
    split, place = split_of(summary), _places(summary)
    tested = {group: value for group, value in found[split.by].items() if value is not None}
    return sorted((place[group], 100 * value) for group, value in tested.items())


def _places(summary: Summary) -> dict[str, float]:
    """Return where the groups lie: speeds in mm/s, others one after the other."""
    ordered = split_of(summary).ordered
    return {
        key_of(group): float(group) if ordered else float(number)
        for number, group in enumerate(groups_in(summary))
    }


def _draw_intervals(axes: Axes, summary: Summary, found: dict[str, Any], protocol: str) -> None:
    """Draw the 95% interval in each group as a bar; earlier results have none."""
    intervals, place = found.get(split_of(summary).ci95_by, {}), _places(summary)
    # Both protocols' bars would hide each other: the second's stand a little to the right.
    aside = _ASIDE * (max(place.values()) - min(place.values())) if protocol == "published" else 0
    at = [place[group] + aside for group in intervals]
    low, high = ([100 * ends[i] for ends in intervals.values()] for i in (0, 1))
    if intervals:
        axes.vlines(at, low, high, color=PROTOCOL_MARKS[protocol][0], lw=2.2, alpha=0.35)


def _name_groups(axes: Axes, summary: Summary) -> None:
    """Name the groups beneath their places."""
    names = [key_of(group) for group in groups_in(summary)]
    turned = 90 if max(map(len, names)) > 4 else 0
    axes.set_xticks(range(len(names)), names, rotation=turned)


def _draw_protocol(
    axes: Axes, points: list[tuple[float, float]], protocol: str, title: str, line: str
) -> None:
    colour, marker, filling = PROTOCOL_MARKS[protocol]
    axes.plot(
        *zip(*points, strict=True),
        color=colour,
        ls=line,
        marker=marker,
        markerfacecolor=filling,
        markersize=4,
        label=title,
    )


def _draw_paper(axes: Axes, summary: Summary, model: str) -> None:
    """Draw the paper's accuracies where it has one of our speeds."""
    paper = published_families().get(model)
    if paper is None:
        return
    speeds = [speed for speed in summary["speeds_mm_s"] if speed in paper.by_speed]
    accuracies = [paper.by_speed[speed] for speed in speeds]
    axes.plot(
        speeds,
        accuracies,
        color=GREY,
        ls="",
        marker="x",
        markersize=4,
        label="paper, its own recordings",
    )


# Accuracy of each texture: which are told best, and the paper's own beside them.
#
# The paper finds the smooth drum and the one with the widest spacing told best: they lie at the
# ends of the series and have a neighbour on one side only. Its accuracies are the diagonals of its
# matrices.

MOST_NAMES = 14
"""Names of textures under an axis; of more, some are left out."""


def accuracy_by_texture(results: Results, model: str, protocol: str) -> dict[str, float]:
    """Return percent of a texture's test samples named rightly, mean over what was held out.

    Textures that were not tested are left out.
    """
    table = results.predictions
    mine = table[(table["model"] == model) & (table["protocol"] == protocol)]
    right = mine["true_texture"] == mine["predicted_texture"]
    groups = [mine["true_texture"], mine[results.split.column]]
    shares: pd.Series = right.groupby(groups, observed=True).mean()
    means = 100 * shares.groupby(level=0, observed=True).mean()
    return {texture: float(means[texture]) for texture in results.textures if texture in means}


def by_texture_table(results: Results) -> Table | None:
    """Return accuracy by texture, the paper's beneath ours; None where nothing was evaluated."""
    rows = [
        row
        for model, protocol, _ in outcomes(results.summary)
        for row in (_own_row(results, model, protocol), *_paper_row(results, model, protocol))
    ]
    if not rows:
        return None
    split, textures = results.split, results.textures
    names = texture_names(textures, results.summary)
    smooth_and_end = _ends(results)
    claim = (
        f"The paper writes that the smooth texture and the one at the end of the series "
        f"({' and '.join(smooth_and_end)}) are recognised best: the last two columns compare their "
        "mean with that of all others. By its own matrices that is so of "
        f"{smooth_and_end[0]}, not of {smooth_and_end[1]}. The paper's figures are the diagonals "
        "of those matrices, measured on its own recordings, under the published protocol. "
        if smooth_and_end
        else ""
    )
    last = (" and ".join(smooth_and_end), "the others") if smooth_and_end else ()
    return Table(
        "Accuracy by texture",
        f"Percent of a texture's test samples named rightly, mean over held-out {split.many}; "
        f"columns are textures. {claim}".rstrip(),
        ("Model", "Protocol", *(names[texture] for texture in textures), *last),
        tuple(rows),
        n_headers=2,
    )


def _ends(results: Results) -> tuple[str, ...]:
    """Return what the smooth texture and the end of the series are called; none of others."""
    if results.split != SPEED or not are_published(results.summary):
        return ()
    names = texture_names(results.textures, results.summary)
    return names[results.textures[0]], names[results.textures[-1]]


def _own_row(results: Results, model: str, protocol: str) -> tuple[Cell, ...]:
    found = accuracy_by_texture(results, model, protocol)
    values = [found.get(texture) for texture in results.textures]
    title = model_title(model, results.summary)
    return Cell(title), Cell(PROTOCOL_TITLES[protocol]), *_cells(results, values)


def _paper_row(results: Results, model: str, protocol: str) -> list[tuple[Cell, ...]]:
    """Return the paper's row beneath the last of ours of a model; none of other textures."""
    last = [p for name, p, _ in outcomes(results.summary) if name == model][-1]
    if protocol != last or model not in published_families() or not _ends(results):
        return []
    values: list[float | None] = published_confusion(model).diagonal().tolist()
    title = model_title(model, results.summary)
    return [(Cell(title), Cell(PAPER_ROW), *_cells(results, values))]


def _cells(results: Results, values: list[float | None]) -> list[Cell]:
    if _ends(results):
        inner = [value for value in values[1:-1] if value is not None]
        ends = [value for value in (values[0], values[-1]) if value is not None]
        values = [*values, *(float(np.mean(one)) if one else None for one in (ends, inner))]
    return [Cell(ABSENT) if value is None else Cell(f"{value:.1f}", value) for value in values]


@styled
def by_texture_figure(results: Results) -> Figure:
    """Draw accuracy in percent by texture, a panel for each model, the paper's as crosses."""
    summary, models = results.summary, model_order(results.summary)
    figure, heading, grid = model_panels(
        len(models), "Accuracy by texture", source_line(summary), height=1.9
    )
    for axes, model in zip(grid.flat, models, strict=False):
        _draw_model_by_texture(axes, results, model)
    axis = texture_axis(results.textures, summary)
    finish_panels(heading, grid, len(models), axis, "accuracy (%)")
    return figure


def _draw_model_by_texture(axes: Axes, results: Results, model: str) -> None:
    textures, summary = results.textures, results.summary
    percent_axes(axes, model_title(model, summary), least=-3)
    for name, protocol, _ in outcomes(summary):
        if name == model:
            found = accuracy_by_texture(results, model, protocol)
            colour, marker, filling = PROTOCOL_MARKS[protocol]
            axes.plot(
                [textures.index(texture) for texture in found], list(found.values()), color=colour,
                lw=0.8, marker=marker, markerfacecolor=filling, markersize=4,
                label=PROTOCOL_TITLES[protocol],
            )  # fmt: skip
    if model in published_families() and _ends(results):
        axes.plot(
            range(len(textures)), published_confusion(model).diagonal(), color=GREY, ls="",
            marker="x", markersize=4, label="paper, its own recordings",
        )  # fmt: skip
    draw_chance(axes, summary["chance"])
    name_textures(axes, texture_names(textures, summary).values(), MOST_NAMES)


# Accuracy against the length of the window, where an evaluation has several.


def has_lengths(summary: Summary) -> bool:
    """Tell whether models were evaluated with windows of several lengths."""
    return bool(summary.get("lengths"))


def lengths_table(summary: Summary) -> Table | None:
    """Return accuracy by length of window, in percent; None where there is but one length."""
    if not has_lengths(summary):
        return None
    lengths = sorted({n for of in summary["lengths"].values() for n in of}, key=int)
    rows = [
        (Cell(model_title(base, summary)), Cell(protocol), *(_cell(of.get(n)) for n in lengths))
        for base in summary["lengths"]
        for protocol in PROTOCOL_TITLES
        if (of := _outcomes(summary, base, protocol))
    ]
    return Table(
        "Accuracy by length of window",
        "Percent of test samples, mean over held-out "
        f"{split_of(summary).many}, with 95% interval in brackets (over {drawn_over(summary)}). "
        "Columns are frames of a window, which is one sample: longer windows are longer touches, "
        "and there are fewer of them to learn from. "
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", *(f"{n} frame{'' if n == '1' else 's'}" for n in lengths)),
        tuple(rows),
        n_headers=2,
    )


@styled
def lengths_figure(summary: Summary) -> Figure:
    """Draw accuracy in percent against the length of the window, a panel for each model."""
    models = list(summary["lengths"])
    title = "Accuracy by length of window"
    figure, heading, grid = model_panels(len(models), title, source_line(summary))
    for axes, base in zip(grid.flat, models, strict=False):
        _draw(axes, summary, base)
    finish_panels(heading, grid, len(models), "frames of a window", "accuracy (%)")
    return figure


def _draw(axes: Axes, summary: Summary, base: str) -> None:
    percent_axes(axes, model_title(base, summary))
    axes.set_xscale("log")
    axes.set_xticks([int(n) for n in summary["lengths"][base]], list(summary["lengths"][base]))
    axes.minorticks_off()
    for protocol, name in PROTOCOL_TITLES.items():
        found = _outcomes(summary, base, protocol)
        if not found:
            continue
        colour, marker, filling = PROTOCOL_MARKS[protocol]
        at = [int(n) for n in found]
        means = [100 * one["mean_accuracy"] for one in found.values()]
        axes.plot(at, means, color=colour, marker=marker, markerfacecolor=filling, markersize=4,
                  label=name)  # fmt: skip
        low, high = ([100 * one["ci95"][i] for one in found.values()] for i in (0, 1))
        axes.vlines(at, low, high, color=colour, lw=2.2, alpha=0.35)
    axes.plot([], [], color=GREY, lw=2.2, alpha=0.5, label="95% interval")
    draw_chance(axes, summary["chance"])


def _outcomes(summary: Summary, base: str, protocol: str) -> dict[str, dict[str, Any]]:
    """Return what came out by length, shortest first, of those that were run."""
    by_length = summary["lengths"][base]
    found = {n: outcome(summary, name, protocol) for n, name in by_length.items()}
    return {n: one for n, one in found.items() if one is not None}


def _cell(found: dict[str, Any] | None) -> Cell:
    if found is None:
        return Cell(ABSENT)
    return Cell(mean_and_interval(found), 100 * found["mean_accuracy"])


# Reliability diagram and table: whether models are right as often as they say.

_SCALED = (
    "Models that are solved at once have a temperature, set at {many} left out inside the fold; "
    "networks are taken as they come out of training."
)
_LARGEST, _SMALLEST = 15.0, 1.7
"""Diameters, points, of the marks of bins that hold all samples, and hardly any."""


def scaled(summary: Summary) -> str:
    """Return what stands behind the confidences."""
    return _SCALED.format(many=split_of(summary).many)


def has_reliability(summary: Summary) -> bool:
    """Tell whether a summary says of any model how reliable it is."""
    return any(found.get("reliability") for _, _, found in outcomes(summary))


@styled
def reliability_figure(summary: Summary) -> Figure:
    """Draw accuracy against confidence, both in percent, a panel for each model."""
    models = model_order(summary)
    figure, heading, grid = model_panels(
        len(models), "Right as often as it says?", source_line(summary), height=2.5
    )
    for axes, model in zip(grid.flat, models, strict=False):
        _draw_reliability_of_model(axes, summary, model)
    finish_panels(heading, grid, len(models), "confidence (%)", "accuracy (%)")
    return figure


def reliability_table(summary: Summary) -> Table:
    """Return the expected calibration error of every model, and on which side it errs."""
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            *_reliability_cells(found.get("reliability")),
        )
        for model, protocol, found in outcomes(summary)
    ]
    return Table(
        "Confidence and accuracy",
        f"Percent of test samples, all {split_of(summary).many} held out together. Confidence is "
        "the mean probability of what a sample is named; ECE, the expected calibration error, the "
        f"mean difference between confidence and accuracy over {_n_bins(summary)} bins of "
        f"confidence. {scaled(summary)}",
        ("Model", "Protocol", "Confidence", "Accuracy", "ECE"),
        tuple(rows),
        n_headers=2,
    )


def _n_bins(summary: Summary) -> int:
    found = (one["reliability"] for _, _, one in outcomes(summary) if one.get("reliability"))
    return len(next(found)["count"])


def _reliability_cells(found: dict[str, Any] | None) -> tuple[Cell, Cell, Cell]:
    if not found:
        return Cell(ABSENT), Cell(ABSENT), Cell(ABSENT)
    confidence, accuracy = (
        float(np.average(found[key], weights=found["count"])) for key in ("confidence", "accuracy")
    )
    return Cell(percent(confidence)), Cell(percent(accuracy)), Cell(percent(found["ece"]))


def _draw_reliability_of_model(axes: Axes, summary: Summary, model: str) -> None:
    axes.set_title(model_title(model, summary), loc="left", fontweight="bold")
    axes.set_xlim(-3, 107)
    axes.set_ylim(-5, 107)
    axes.set_xticks(range(0, 101, 20))
    axes.set_yticks(range(0, 101, 20))
    axes.grid(color=LINE, lw=0.4)
    axes.plot([0, 100], [0, 100], color=GREY, lw=0.8, ls=(0, (4, 3)), label="as often as it says")
    said = []
    for protocol, title in PROTOCOL_TITLES.items():
        found = outcome(summary, model, protocol)
        if found is not None and found.get("reliability"):
            _draw_reliability_of_protocol(axes, found["reliability"], protocol, title)
            said.append((protocol, f"ECE {percent(found['reliability']['ece'])} %"))
    for line, (protocol, text) in enumerate(reversed(said)):
        place = (0.97, 0.04 + 0.1 * line)
        axes.text(
            *place, text, transform=axes.transAxes, ha="right", color=PROTOCOL_MARKS[protocol][0]
        )


def _draw_reliability_of_protocol(
    axes: Axes, found: dict[str, Any], protocol: str, title: str
) -> None:
    """Draw a mark a bin, the larger the more samples it holds: its area is their share."""
    colour, marker, filling = PROTOCOL_MARKS[protocol]
    count = np.array(found["count"])
    filled = count > 0
    x, y = (100 * np.array(found[key])[filled] for key in ("confidence", "accuracy"))
    area = np.maximum(_LARGEST**2 * count[filled] / count.sum(), _SMALLEST**2)
    axes.scatter(
        x, y, s=area, c=filling, edgecolors=colour, linewidths=0.8, marker=marker, zorder=3,
        alpha=0.85,
    )  # fmt: skip
    axes.plot(
        [], [], color=colour, ls="", marker=marker, markerfacecolor=filling, markersize=5,
        label=title,
    )  # fmt: skip

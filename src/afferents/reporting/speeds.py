"""Accuracy against what was held out, a panel for each model: how well texture carries over."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.split import SPEED, key_of, split_of
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    groups_in,
    model_order,
    model_title,
    outcome,
    source_line,
)
from afferents.reporting.published import published_families
from afferents.reporting.style import (
    GREY,
    PROTOCOL_MARKS,
    draw_chance,
    finish_panels,
    model_panels,
    percent_axes,
    styled,
)
from afferents.reporting.texture_names import are_published

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

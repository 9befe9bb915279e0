"""Accuracy against held-out speed, a panel for each model: how well texture carries over."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    model_order,
    model_title,
    outcome,
    source_line,
)
from afferents.reporting.published import published_families
from afferents.reporting.style import (
    GREY,
    LINE,
    PROTOCOL_MARKS,
    finish_panels,
    model_panels,
    styled,
)


@styled
def speed_figure(summary: Summary) -> Figure:
    """Draw accuracy in percent by held-out speed under the protocols that were run."""
    models = model_order(summary)
    figure, heading, grid = model_panels(
        len(models), "Accuracy by held-out speed", source_line(summary)
    )
    for axes, model in zip(grid.flat, models, strict=False):
        _draw_model(axes, summary, model)
    finish_panels(heading, grid, len(models), "held-out speed (mm/s)", "accuracy (%)")
    return figure


def _draw_model(axes: Axes, summary: Summary, model: str) -> None:
    axes.set_title(model_title(model, summary), loc="left", fontweight="bold")
    axes.set_ylim(0, 103)
    axes.set_yticks(range(0, 101, 20))
    axes.grid(axis="y", color=LINE, lw=0.4)
    _draw_paper(axes, summary, model)
    for protocol, title in PROTOCOL_TITLES.items():
        found = outcome(summary, model, protocol)
        if found is not None:
            _draw_protocol(axes, found, protocol, title)
    axes.axhline(100 * summary["chance"], color=GREY, lw=0.8, ls=(0, (4, 3)), label="chance")


def _draw_protocol(axes: Axes, found: dict[str, Any], protocol: str, title: str) -> None:
    colour, marker, filling = PROTOCOL_MARKS[protocol]
    tested = {speed: value for speed, value in found["by_speed"].items() if value is not None}
    points = sorted((float(speed), 100 * value) for speed, value in tested.items())
    axes.plot(
        *zip(*points, strict=True),
        color=colour,
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

"""Accuracy against held-out speed, a panel for each model: how well texture carries over."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.report.labels import (
    PROTOCOL_TITLES,
    Summary,
    model_order,
    model_title,
    outcome,
    source_line,
)
from afferents.report.published import published_families
from afferents.report.style import BLUE, GREY, LINE, VERMILION, new_figure, styled

_MARKS = {"nested": (BLUE, "o", BLUE), "published": (VERMILION, "s", "white")}
"""Colour, marker and filling of the points of each protocol."""
_COLUMNS = 3


@styled
def speed_figure(summary: Summary) -> Figure:
    """Draw accuracy in percent by held-out speed under the protocols that were run."""
    models = model_order(summary)
    n_columns = min(_COLUMNS, len(models))
    n_rows = -(-len(models) // n_columns)
    figure = new_figure(
        max(3.0 * n_columns + 0.5, 6.0),
        2.1 * n_rows + 1.0,
        "Accuracy by held-out speed",
        source_line(summary),
    )
    heading, *rows = figure.subplots(
        n_rows + 1,
        n_columns,
        squeeze=False,
        sharex=True,
        sharey=True,
        gridspec_kw={"height_ratios": [0.08, *[1.0] * n_rows]},
    )
    grid = np.array(rows)
    for axes, model in zip(grid.flat, models, strict=False):
        _draw_model(axes, summary, model)
    for axes in grid.flat[len(models) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("held-out speed (mm/s)")
    for axes in grid[:, 0]:
        axes.set_ylabel("accuracy (%)")
    handles, names = grid[0, 0].get_legend_handles_labels()
    for axes in heading:
        axes.set_axis_off()
    legend = heading[0].legend(handles, names, loc="center left", ncols=len(names))
    legend.set_in_layout(False)
    return figure


def _draw_model(axes: Axes, summary: Summary, model: str) -> None:
    axes.set_title(model_title(model), loc="left", fontweight="bold")
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
    colour, marker, filling = _MARKS[protocol]
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

"""Reliability diagram and table: whether models are right as often as they say."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.split import split_of
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    source_line,
)
from afferents.reporting.style import (
    GREY,
    LINE,
    PROTOCOL_MARKS,
    finish_panels,
    model_panels,
    styled,
)
from afferents.reporting.table import Cell, Table

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
        _draw_model(axes, summary, model)
    finish_panels(heading, grid, len(models), "confidence (%)", "accuracy (%)")
    return figure


def reliability_table(summary: Summary) -> Table:
    """Return the expected calibration error of every model, and on which side it errs."""
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            *_cells(found.get("reliability")),
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


def _cells(found: dict[str, Any] | None) -> tuple[Cell, Cell, Cell]:
    if not found:
        return Cell(ABSENT), Cell(ABSENT), Cell(ABSENT)
    confidence, accuracy = (
        float(np.average(found[key], weights=found["count"])) for key in ("confidence", "accuracy")
    )
    return Cell(percent(confidence)), Cell(percent(accuracy)), Cell(percent(found["ece"]))


def _draw_model(axes: Axes, summary: Summary, model: str) -> None:
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
            _draw_protocol(axes, found["reliability"], protocol, title)
            said.append((protocol, f"ECE {percent(found['reliability']['ece'])} %"))
    for line, (protocol, text) in enumerate(reversed(said)):
        place = (0.97, 0.04 + 0.1 * line)
        axes.text(
            *place, text, transform=axes.transAxes, ha="right", color=PROTOCOL_MARKS[protocol][0]
        )


def _draw_protocol(axes: Axes, found: dict[str, Any], protocol: str, title: str) -> None:
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

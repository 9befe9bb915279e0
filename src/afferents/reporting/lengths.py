"""Accuracy against the length of the window, where an evaluation has several."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.split import split_of
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
    model_title,
    outcome,
    preset_note,
    source_line,
)
from afferents.reporting.replicates import drawn_over
from afferents.reporting.style import (
    GREY,
    PROTOCOL_MARKS,
    draw_chance,
    finish_panels,
    model_panels,
    percent_axes,
    styled,
)
from afferents.reporting.table import Cell, Table, mean_and_interval


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

"""Plots of an evaluation: what is taken for what, and how accuracy goes with speed."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from afferents.core.errors import InputError
from afferents.core.recording import natural_order
from afferents.core.results import Results
from afferents.core.split import SPEED, column_of, group_in, order, split_of
from afferents.reporting.confusion import (
    OF_TRUE,
    Panel,
    count_confusion,
    draw_panel,
    label_edges,
    percent_of_true,
    write_numbers,
)
from afferents.reporting.labels import PROTOCOL_TITLES, model_title, speed_key
from afferents.reporting.plot.basics import COLOURS, axes_of
from afferents.reporting.style import GREY, LINE, styled

_TEXTURES = ["true_texture", "predicted_texture"]
_ACCURACY = ("model", "protocol", "accuracy")


@styled
def confusion(
    results: Results | pd.DataFrame,
    *,
    model: str | None = None,
    protocol: str | None = None,
    held_out_mm_s: float | None = None,
    held_out: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a confusion matrix: which texture is taken for which, in percent.

    Parameters
    ----------
    results
        `Results`, or a table of predictions as theirs.
    model, protocol
        Which of those evaluated; may be left out where there is one.
    held_out_mm_s
        Speed held out, mm/s; None for all of them together.
    held_out
        Group held out, of results of another split; None for all of them together.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        True textures to the right, predicted ones up; every column sums to 100 %. The title gives
        the accuracy.

    Raises
    ------
    InputError
        If there are several models or protocols to choose from, or none as named.
    """
    rows = results.predictions if isinstance(results, Results) else results
    _require_columns(rows, _TEXTURES)
    named = rows[_TEXTURES].to_numpy().ravel()
    textures = sorted({str(name) for name in named}, key=natural_order)
    summary = results.summary if isinstance(results, Results) else {}
    rows, chosen = _chosen(rows, "model", model)
    title = [model_title(chosen, summary)] if chosen else []
    rows, chosen = _chosen(rows, "protocol", protocol)
    title += [PROTOCOL_TITLES.get(chosen, chosen)] if chosen else []
    if held_out_mm_s is not None:
        rows, _ = _chosen(rows, "held_out_speed_mm_s", held_out_mm_s)
        title.append(f"{speed_key(held_out_mm_s)} mm/s held out")
    if held_out is not None:
        rows, _ = _chosen(rows, "held_out_group", held_out)
        title.append(f"{split_of(summary).printed(held_out) if summary else held_out} held out")
    counts = count_confusion(rows, textures)
    accuracy = 100 * np.trace(counts) / counts.sum()
    ax = axes_of(ax, 4.6, 4.0)
    panel = Panel(", ".join([*title, f"{accuracy:.0f} %"]), percent_of_true(counts))
    image = draw_panel(ax, panel)
    write_numbers(ax, panel, ax.bbox.width / ax.figure.dpi)
    label_edges(np.array([[ax]]), textures, summary)
    ax.figure.colorbar(image, ax=ax, label=OF_TRUE).outline.set_visible(False)
    return ax


@styled
def accuracy_by_speed(
    results: Results | pd.DataFrame,
    *,
    models: Sequence[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how many samples are named rightly at each speed held out, a line for each model.

    Of results of another split, in each group held out.

    Parameters
    ----------
    results
        `Results`, or the table `Results.accuracy`.
    models
        Names of those to draw; None for all.
    ax
        Where to draw; None for a figure of its own.

    Returns
    -------
    matplotlib.axes.Axes
        Held-out speed in mm/s, or the group's name; accuracy in percent. Open marks: the published
        protocol. Of `Results`, a dashed line is chance.

    Raises
    ------
    InputError
        If a model was not evaluated, or the table lacks a column.
    """
    table = results.accuracy if isinstance(results, Results) else results
    _require_columns(table, _ACCURACY)
    held_out = column_of(table) if column_of(table) in table else SPEED.column
    _require_columns(table, [held_out])
    summary = results.summary if isinstance(results, Results) else {}
    there = list(dict.fromkeys(table["model"]))
    for name in models or ():
        if name not in there:
            raise InputError("models", f"some of {', '.join(there)}", f"'{name}'")
    ax = axes_of(ax, 6.4, 3.0)
    tested = table.dropna(subset=[held_out, "accuracy"])
    groups = sorted({group_in(value) for value in tested[held_out]}, key=order)
    several = len(set(tested["protocol"])) > 1
    for number, name in enumerate(models or there):
        for protocol, rows in tested[tested["model"] == name].groupby("protocol"):
            line = rows.sort_values(held_out, key=lambda column: column.map(groups.index))
            colour, open_mark = COLOURS[number % len(COLOURS)], protocol == "published"
            ax.plot(
                line[held_out],
                100 * line["accuracy"],
                color=colour,
                ls=("--" if open_mark else "-") if held_out == SPEED.column else "",
                marker="s" if open_mark else "o",
                markersize=4,
                markerfacecolor="white" if open_mark else colour,
                label=model_title(name, summary) + (f", {protocol}" if several else ""),
            )
    if "chance" in summary:
        ax.axhline(100 * summary["chance"], color=GREY, lw=0.8, ls=(0, (4, 3)), label="chance")
    axis = split_of(summary).axis if held_out != SPEED.column else SPEED.axis
    ax.set(xlabel=f"held-out {axis}", ylabel="accuracy (%)", ylim=(0, 103))
    ax.grid(axis="y", color=LINE, lw=0.4)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def _require_columns(table: object, names: Sequence[str]) -> None:
    if not isinstance(table, pd.DataFrame):
        raise InputError("results", "Results, or a table of theirs", type(table).__name__)
    for name in names:
        if name not in table:
            raise InputError("results", f"a table with the column '{name}'", "none of that name")


def _chosen(
    rows: pd.DataFrame, column: str, wanted: str | float | None
) -> tuple[pd.DataFrame, str]:
    """Return the rows of one value of a column, and the value; the only one where none is named.

    Raises
    ------
    InputError
        If there are several to choose from, or none of that name.
    """
    if column not in rows and wanted is None:
        return rows, ""
    _require_columns(rows, [column])
    there = list(dict.fromkeys(rows[column]))
    if wanted is None and len(there) != 1:
        raise InputError(column, f"one of {', '.join(map(str, there))}", "none chosen")
    one = there[0] if wanted is None else wanted
    if one not in there:
        raise InputError(column, f"one of {', '.join(map(str, there))}", f"'{one}'")
    return rows[rows[column] == one], str(one)

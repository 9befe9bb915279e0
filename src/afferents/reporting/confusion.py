"""Figures 9, 11 and 13: one confusion matrix a held-out speed, in percent of the true texture."""

from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from afferents.choices import Figures
from afferents.evaluation.metrics import accuracy_by_group, confusion
from afferents.evaluation.results import Results, Summary
from afferents.folds.held_out import SPEED, order
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    are_published,
    model_title,
    source_line,
    texture_axis,
    texture_names,
)
from afferents.reporting.published import published_confusion, published_families
from afferents.reporting.style import (
    GREY,
    INK,
    PERCENT,
    add_bar,
    draw_cells,
    hide,
    name_places,
    new_figure,
    styled,
)

# As in the paper, x is the true and y the predicted texture, so every column sums to 100 %; y goes
# up here, where the print has the first texture at the top. Each column is divided by its own
# number of test samples. The paper divides counts by 25, 2.5 and 0.3: percent of its 2,500 and 250
# samples in Figures 9 and 11, but twice the percentage of its 60 in Figure 13, which saturates.

FIGURE_OF = {
    "sa-se": "Figure 9A",
    "sa-ste": "Figure 9B",
    "ra-se": "Figure 11A",
    "ra-ste": "Figure 11B",
    "vib-te": "Figure 13A",
    "vib-te-aug": "Figure 13B",
}
"""Where the paper shows each family's matrices."""
OF_TRUE = "% of the true texture's test samples"
MOST_TICKS = 14
_WIDTH_INCH, _PANELS_INCH = 9.4, 7.7
"""Width of the figure, and what of it the panels of a row share."""
MANY_TEXTURES = 10
"""Of more there are three panels a row, so that cells are large enough for their numbers."""
_LEAST_POINTS, _MOST_POINTS, _OF_CELL = 5.5, 8.0, 0.43
"""Size of the numbers in cells, pt: no smaller, no larger, and what share of a cell."""
LEAST_WRITTEN, _DARK = 5.0, 55.0
"""Percent that are written as a number, and from where on in white."""
TWICE = ("vib-te", "vib-te-aug")
"""Models whose matrices the paper prints at twice the percentage."""
_PAPER_COLUMNS = 5


@dataclass(frozen=True)
class Panel:
    """One matrix to draw: percent[true, predicted], NaN rows where nothing was tested."""

    title: str
    percent: NDArray[np.float64]


def percent_of_true(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return percent[true, predicted] of the test samples of each true texture.

    Every row sums to 100, and is NaN where a texture has no test sample.
    """
    totals = counts.sum(axis=1, keepdims=True)
    return np.where(totals > 0, 100.0 * counts / np.maximum(totals, 1), np.nan)


@styled
def confusion_figure(
    results: Results, model: str, protocol: str, style: Figures = "report"
) -> Figure | None:
    """Draw a matrix for every group held out; None if it was not evaluated.

    Parameters
    ----------
    style
        `report` adds one over all groups, and the paper's mean matrix where textures are its own.
        `paper` draws what the model's figure in the paper has, five in a row, the first texture at
        the top left, and None of what has no such figure; of Figure 13 also as it is printed.
    """
    rows = results.predictions
    rows = rows[(rows["model"] == model) & (rows["protocol"] == protocol)]
    printed = style == "paper"
    if rows.empty or (printed and not is_in_paper(model, results.found)):
        return None
    panels = _panels(results, rows, "" if printed else " held out")
    blocks = [("", OF_TRUE, panels)]
    if printed and model in TWICE:
        twice = [replace(one, percent=np.minimum(2 * one.percent, 100)) for one in panels]
        blocks = [("as printed: twice the percentage, at most 100", "as printed", twice),
                  ("as it should be", OF_TRUE, panels)]  # fmt: skip
    elif not printed:
        panels += [
            _panel(rows, results.textures, f"all held-out {results.split.many}"),
            *_paper_panel(model, results),
        ]
    n_columns = _columns(len(panels), len(results.textures), printed)
    n_rows = -(-len(panels) // n_columns)
    said_inch = 0.3 if len(blocks) > 1 else 0
    names = 0.04 * max(map(len, results.textures))
    height = len(blocks) * (n_rows * (_PANELS_INCH / n_columns + 0.34) + said_inch) + 0.8 + names
    title = confusion_title(model, protocol, results.found)
    figure = new_figure(_WIDTH_INCH, height, title, source_line(results.found))
    parts = figure.subfigures(len(blocks), 1, squeeze=False)
    for part, (said, label, shown) in zip(parts.flat, blocks, strict=True):
        part.suptitle(said, fontsize=9, x=0.055, ha="left")
        grid = part.subplots(n_rows, n_columns, squeeze=False)
        for axes, panel in zip(grid.flat, shown, strict=False):
            drawn = draw_panel(axes, panel, "upper" if printed else "lower")
            write_numbers(axes, panel, _PANELS_INCH / n_columns)
        hide(list(grid.flat)[len(shown) :])
        label_edges(grid, results.textures, results.found.named_by_spacing)
        add_bar(part, drawn, list(grid.flat), label, fraction=0.02, pad=0.015, aspect=30)
    return figure


def is_in_paper(model: str, summary: Summary) -> bool:
    """Tell whether the paper has a figure of a model's matrices."""
    return model in FIGURE_OF and summary.split == SPEED


def confusion_title(model: str, protocol: str, summary: Summary) -> str:
    """Return the number that the figure has in the paper, the model and the protocol."""
    number = f"{FIGURE_OF[model]}. " if is_in_paper(model, summary) else ""
    return f"{number}{model_title(model, summary)}, {PROTOCOL_TITLES[protocol]}"


def _panel(rows: pd.DataFrame, textures: list[str], title: str) -> Panel:
    counts = confusion(rows, textures)
    accuracy = 100 * fmean(accuracy_by_group(rows).values())
    return Panel(f"{title}: {accuracy:.0f}%", percent_of_true(counts))


def _panels(results: Results, rows: pd.DataFrame, said: str = "") -> list[Panel]:
    """Return a matrix for each group held out."""
    held_out, split = rows[results.split.column], results.split
    return [
        _panel(rows[held_out == group], results.textures, f"{split.printed(group)}{said}")
        for group in sorted(held_out.unique().tolist(), key=order)
    ]


def _paper_panel(model: str, results: Results) -> list[Panel]:
    if model not in published_families() or not are_published(results.found):
        return []
    mean = published_families()[model].mean_percent
    return [Panel(f"paper, its own recordings: {mean}%", published_confusion(model))]


def _columns(n_panels: int, n_textures: int, printed: bool) -> int:
    """Return 5 in print, else 4, or 3 where that leaves fewer empty or textures are many."""
    if printed:
        return min(_PAPER_COLUMNS, n_panels)
    if n_panels <= 3 or n_textures > MANY_TEXTURES:
        return min(3, n_panels)
    return min((4, 3), key=lambda n: (-n_panels % n, -n))


def draw_panel(axes: Axes, panel: Panel, origin: Literal["lower", "upper"] = "lower") -> AxesImage:
    """Draw one matrix, true textures to the right and predicted ones up, or down from the upper."""
    axes.set_title(panel.title)
    return draw_cells(axes, panel.percent.T, PERCENT, 0, 100, origin=origin)


def write_numbers(axes: Axes, panel: Panel, width_inch: float) -> None:
    """Write percentages into the cells of a matrix of that width, where they can be read."""
    size = min(_MOST_POINTS, _OF_CELL * 72 * width_inch / len(panel.percent))
    if size < _LEAST_POINTS:
        return
    for true, predicted in np.argwhere(panel.percent >= LEAST_WRITTEN):
        value = panel.percent[true, predicted]
        colour = "white" if value > _DARK else INK
        axes.text(
            true, predicted, f"{value:.0f}", ha="center", va="center", fontsize=size, color=colour
        )


def label_edges(grid: NDArray[Any], textures: list[str], by_spacing: bool) -> None:
    """Name the textures on every axis of the left column, and on the lowest of each column."""
    names, axis = texture_names(textures, by_spacing), texture_axis(textures, by_spacing)
    shown, step = list(names.values()), -(-len(names) // MOST_TICKS)
    for axes in grid.flat:
        axes.set(xticks=[], yticks=[])
        axes.tick_params(length=2, color=GREY)
    for axes in (column[[one.get_visible() for one in column]][-1] for column in grid.T):
        name_places(axes, shown, MOST_TICKS, fontsize=6)
        axes.set_xlabel(f"true {axis}", fontsize=7)
    for axes in grid[:, 0]:
        axes.set_yticks(range(0, len(shown), step), shown[::step], fontsize=6)
        axes.set_ylabel(f"predicted {axis}", fontsize=7)

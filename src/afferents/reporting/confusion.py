"""Figures 9, 11 and 13: one confusion matrix a held-out speed, in percent of the true texture.

As in the paper, x is the true and y the predicted texture, so every column sums to 100 %; y goes
up here, where the print has the first texture at the top. Each column is divided by its own number
of test samples: the paper's Figure 13 divides 60 samples by 30 and so shows twice the percentage.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from afferents.core.results import Results
from afferents.core.split import SPEED, order, split_of
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    model_title,
    source_line,
)
from afferents.reporting.published import (
    published_confusion,
    published_families,
)
from afferents.reporting.style import GREY, INK, MISSING, PERCENT, frame_all, new_figure, styled
from afferents.reporting.texture_names import About, are_published, texture_axis, texture_names

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


@dataclass(frozen=True)
class Panel:
    """One matrix to draw: percent[true, predicted], NaN rows where nothing was tested."""

    title: str
    percent: NDArray[np.float64]


def count_confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Count predictions by true and predicted texture.

    Returns
    -------
    Shape (n_textures, n_textures), counts[true, predicted].
    """
    true, predicted = (
        pd.Categorical(predictions[column], categories=textures).codes.astype(np.int64)
        for column in ("true_texture", "predicted_texture")
    )
    n = len(textures)
    return np.bincount(true * n + predicted, minlength=n * n).reshape(n, n).astype(np.int64)


def percent_of_true(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return percent[true, predicted] of the test samples of each true texture.

    Every row sums to 100, and is NaN where a texture has no test sample.
    """
    totals = counts.sum(axis=1, keepdims=True)
    return np.where(totals > 0, 100.0 * counts / np.maximum(totals, 1), np.nan)


@styled
def confusion_figure(results: Results, model: str, protocol: str) -> Figure | None:
    """Draw a matrix for every group held out and one over all; None if it was not evaluated.

    Where the textures are the paper's, its own mean matrix is drawn last for comparison.
    """
    rows = results.predictions
    rows = rows[(rows["model"] == model) & (rows["protocol"] == protocol)]
    if rows.empty:
        return None
    textures = results.textures
    panels = [*_own_panels(rows, results), *_paper_panel(model, results)]
    n_columns = _columns(len(panels), len(textures))
    n_rows = -(-len(panels) // n_columns)
    height = n_rows * (_PANELS_INCH / n_columns + 0.34) + 0.8 + 0.04 * max(map(len, textures))
    summary = results.summary
    title, source = confusion_title(model, protocol, summary), source_line(summary)
    figure = new_figure(_WIDTH_INCH, height, title, source)
    _draw_grid(figure, panels, textures, summary, (n_rows, n_columns))
    return figure


def confusion_title(model: str, protocol: str, summary: Summary) -> str:
    """Return the number that the figure has in the paper, the model and the protocol."""
    of_paper = model in FIGURE_OF and split_of(summary) == SPEED
    number = f"{FIGURE_OF[model]}. " if of_paper else ""
    return f"{number}{model_title(model, summary)}, {PROTOCOL_TITLES[protocol]}"


def _own_panels(rows: pd.DataFrame, results: Results) -> list[Panel]:
    textures, split = results.textures, results.split
    held_out = rows[split.column]
    by_group = [
        (f"{split.printed(group)} held out", count_confusion(rows[held_out == group], textures))
        for group in sorted(held_out.unique().tolist(), key=order)
    ]
    everything = (f"all held-out {split.many}", count_confusion(rows, textures))
    return [
        Panel(f"{title}: {_accuracy(counts):.0f} %", percent_of_true(counts))
        for title, counts in (*by_group, everything)
    ]


def _paper_panel(model: str, results: Results) -> list[Panel]:
    same = results.split == SPEED and are_published(results.summary)
    if model not in published_families() or not same:
        return []
    mean = published_families()[model].mean_percent
    return [Panel(f"paper, its own recordings: {mean} %", published_confusion(model))]


def _accuracy(counts: NDArray[np.int64]) -> float:
    return float(100 * np.trace(counts) / counts.sum())


def _columns(n_panels: int, n_textures: int) -> int:
    """Return 4 columns, or 3 where that leaves fewer places empty or textures are many."""
    if n_panels <= 3 or n_textures > MANY_TEXTURES:
        return min(3, n_panels)
    return min((4, 3), key=lambda n: (-n_panels % n, -n))


def _draw_grid(
    figure: Figure, panels: list[Panel], textures: list[str], about: About, shape: tuple[int, int]
) -> None:
    grid = figure.subplots(*shape, squeeze=False)
    cells = list(grid.flat)
    for axes, panel in zip(cells, panels, strict=False):
        image = draw_panel(axes, panel)
        write_numbers(axes, panel, _PANELS_INCH / shape[1])
    for axes in cells[len(panels) :]:
        axes.set_visible(False)
    label_edges(grid, textures, about)
    bar = figure.colorbar(image, ax=cells, fraction=0.02, pad=0.015, aspect=30)
    bar.set_label(OF_TRUE)
    bar.outline.set_visible(False)


def draw_panel(axes: Axes, panel: Panel, origin: Literal["lower", "upper"] = "lower") -> AxesImage:
    """Draw one matrix, true textures to the right and predicted ones up, or down from the upper."""
    axes.set_facecolor(MISSING)
    axes.set_title(panel.title)
    frame_all(axes)
    return axes.imshow(
        panel.percent.T, cmap=PERCENT, vmin=0, vmax=100, origin=origin, interpolation="nearest"
    )


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


def label_edges(grid: NDArray[Any], textures: list[str], about: About) -> None:
    """Name the textures on every axis of the left column, and on the lowest of each column."""
    step = -(-len(textures) // MOST_TICKS)
    ticks = list(range(0, len(textures), step))
    named, axis = texture_names(textures, about), texture_axis(textures, about)
    names = [named[textures[index]] for index in ticks]
    turned = 90 if max(map(len, names)) > 3 else 0
    for axes in grid.flat:
        axes.set_xticks([])
        axes.set_yticks([])
        axes.tick_params(length=2, color=GREY)
    for axes in (column[[one.get_visible() for one in column]][-1] for column in grid.T):
        axes.set_xticks(ticks, names, rotation=turned, fontsize=6)
        axes.set_xlabel(f"true {axis}", fontsize=7)
    for axes in grid[:, 0]:
        axes.set_yticks(ticks, names, fontsize=6)
        axes.set_ylabel(f"predicted {axis}", fontsize=7)

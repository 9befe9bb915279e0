"""Figures 9, 11 and 13 as drawn: ten confusion matrices, one a held-out speed, a at the top left.

The paper divides counts by 25, 2.5 and 0.3. That is percent for Figures 9 and 11, which have 2,500
and 250 test samples of each texture. Figure 13 has 60 and is divided as if there were 30: it shows
twice the percentage, and saturates at half. Here each count is divided by the number of its own
test samples; Figure 13 is drawn so, and above that as it is printed.
"""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.results import Results
from afferents.core.split import order
from afferents.reporting.confusion import (
    FIGURE_OF,
    OF_TRUE,
    Panel,
    confusion_title,
    count_confusion,
    draw_panel,
    label_edges,
    percent_of_true,
)
from afferents.reporting.labels import source_line
from afferents.reporting.style import new_figure, styled

COLUMNS = 5
TWICE = ("vib-te", "vib-te-aug")
"""Models whose matrices are printed at twice the percentage."""


@styled
def matrices_figure(results: Results, model: str, protocol: str) -> Figure | None:
    """Draw a model's matrices as its figure in the paper; None of what has no such figure."""
    rows = results.predictions
    rows = rows[(rows["model"] == model) & (rows["protocol"] == protocol)]
    if model not in FIGURE_OF or rows.empty:
        return None
    panels = _panels(results, model, protocol)
    blocks = [("", panels)]
    if model in TWICE:
        printed = [replace(one, percent=np.minimum(2 * one.percent, 100)) for one in panels]
        blocks = [("as printed: twice the percentage, cut off at 100", printed),
                  ("as it should be", panels)]  # fmt: skip
    n_rows = -(-len(panels) // COLUMNS)
    title = confusion_title(model, protocol, results.summary)
    height = len(blocks) * (1.8 * n_rows + (0.4 if len(blocks) > 1 else 0.2)) + 0.7
    figure = new_figure(9.4, height, title, source_line(results.summary))
    whole = figure.subfigures(len(blocks), 1, squeeze=False)
    for part, (said, shown) in zip(whole.flat, blocks, strict=True):
        if said:
            part.suptitle(said, fontsize=9, x=0.055, ha="left")
        grid = part.subplots(n_rows, min(COLUMNS, len(shown)), squeeze=False)
        for axes, panel in zip(grid.flat, shown, strict=False):
            image = draw_panel(axes, panel, "upper")
            _small(axes)
        for axes in list(grid.flat)[len(shown) :]:
            axes.set_visible(False)
        label_edges(grid, results.textures, results.summary)
        bar = part.colorbar(image, ax=grid, fraction=0.02, pad=0.012, aspect=26)
        bar.set_label("as printed" if said.startswith("as printed") else OF_TRUE, fontsize=7)
        bar.ax.tick_params(labelsize=7)
        bar.outline.set_visible(False)
    return figure


def _panels(results: Results, model: str, protocol: str) -> list[Panel]:
    rows = results.predictions
    rows = rows[(rows["model"] == model) & (rows["protocol"] == protocol)]
    held_out, split = rows[results.split.column], results.split
    found = []
    for group in sorted(held_out.unique().tolist(), key=order):
        counts = count_confusion(rows[held_out == group], results.textures)
        accuracy = 100 * np.trace(counts) / counts.sum()
        found.append(Panel(f"{split.printed(group)}: {accuracy:.0f} %", percent_of_true(counts)))
    return found


def _small(axes: Axes) -> None:
    axes.set_title(axes.get_title(), fontsize=8)

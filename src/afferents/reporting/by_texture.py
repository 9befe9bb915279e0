"""Accuracy of each texture: which are told best, and the paper's own beside them.

The paper finds the smooth drum and the one with the widest spacing told best: they lie at the ends
of the series and have a neighbour on one side only. Its accuracies are the diagonals of its
matrices.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.results import Results
from afferents.core.split import SPEED
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    model_order,
    model_title,
    outcomes,
    source_line,
)
from afferents.reporting.published import published_confusion, published_families
from afferents.reporting.style import (
    GREY,
    PROTOCOL_MARKS,
    draw_chance,
    finish_panels,
    model_panels,
    name_textures,
    percent_axes,
    styled,
)
from afferents.reporting.table import PAPER_ROW, Cell, Table
from afferents.reporting.texture_names import are_published, texture_axis, texture_names

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
        f"The paper tells the smooth texture and the one at the end of the series "
        f"({' and '.join(smooth_and_end)}) best: the last two columns compare their mean with that "
        "of all others. The paper's figures are the diagonals of its matrices, measured on its own "
        "recordings, under the published protocol. "
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
        _draw_model(axes, results, model)
    axis = texture_axis(results.textures, summary)
    finish_panels(heading, grid, len(models), axis, "accuracy (%)")
    return figure


def _draw_model(axes: Axes, results: Results, model: str) -> None:
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

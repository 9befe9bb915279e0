"""Artificial units beside natural fibres: what is read from each, and whether trains stretch."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.reporting.neural.style import ACROSS, CLASS_COLOURS, accuracy_axes
from afferents.reporting.style import GREY, draw_chance, new_figure, percent_axes, styled

STYLES = {"artificial": "-", "natural": "--"}
"""How the lines of each population are drawn."""


@styled
def beside_figure(resolution: pd.DataFrame, matches: pd.DataFrame, source: str) -> Figure:
    """Draw decoding by resolution and matches across speeds, of both populations.

    Parameters
    ----------
    resolution, matches
        As `accuracy_by_resolution` and `match_by_class` give them, with a column `population` more:
        ``artificial`` or ``natural``.
    """
    figure = new_figure(11.5, 3.3, "Artificial units beside natural fibres", source)
    *panels, bars = figure.subplots(1, 3)
    for across, axes in zip(ACROSS, panels, strict=True):
        here = resolution[resolution["across"] == across]
        for (name, population), some in here.groupby(["class", "population"], sort=False):
            x, y = 1e3 * some["resolution_s"].to_numpy(), 100 * some["accuracy"].to_numpy()
            colour, style = CLASS_COLOURS[str(name)], STYLES[str(population)]
            axes.plot(x, y, style, color=colour, marker="o", ms=3, label=f"{name}, {population}")
        draw_chance(axes, float(resolution["chance"].iloc[0]))
        accuracy_axes(axes, f"At {ACROSS[across]}", "width of a bin (ms)")
    panels[0].legend(loc="upper left", fontsize=6.5, ncols=2)
    _bars(bars, matches)
    return figure


def _bars(axes: Axes, matches: pd.DataFrame) -> None:
    names = list(dict.fromkeys(matches["class"]))
    bars = [(p, s) for p in STYLES for s in (False, True)]
    for number, (population, stretched) in enumerate(bars):
        some = matches[
            (matches["population"] == population) & (matches["stretched"] == stretched)
        ].set_index("class").reindex(names)  # fmt: skip
        at = np.arange(len(names)) + (number - 1.5) * 0.2
        colours = [CLASS_COLOURS[name] for name in names]
        hatch = "" if population == "artificial" else "///"
        alpha = 1.0 if stretched else 0.35
        height = 100 * some["accuracy"].to_numpy()
        axes.bar(at, height, 0.18, color=colours, hatch=hatch, alpha=alpha, edgecolor="white", lw=0)
    for label, alpha, hatch in (
        ("as they are", 0.35, ""), ("stretched", 1.0, ""), ("natural", 0.6, "///"),
    ):  # fmt: skip
        axes.bar([0], [0], color=GREY, alpha=alpha, hatch=hatch, edgecolor="white", label=label)
    draw_chance(axes, float(matches["chance"].iloc[0]))
    percent_axes(axes, "Trains matched across speeds")
    axes.set_xticks(range(len(names)), names)
    axes.set_ylabel("textures found (%)")
    axes.legend(loc="upper right", fontsize=6.5)

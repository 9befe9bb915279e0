"""What speed does to spikes: slopes of rates, and trains matched across speeds."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from afferents.reporting.neural.style import CLASS_COLOURS
from afferents.reporting.style import GREY, draw_chance, new_figure, percent_axes, styled


@styled
def slope_figure(slopes: pd.DataFrame, source: str) -> Figure:
    """Draw how units' rates grow with speed; see `spikes.analysis.rate_slopes`."""
    figure = new_figure(6.4, 2.9, "How firing rates grow with speed", source)
    axes = figure.subplots()
    known = slopes.dropna(subset=["slope"])
    low, high = (known["slope"].min(), known["slope"].max()) if len(known) else (0.0, 1.0)
    bins = np.linspace(float(low), float(high), 30).tolist()
    for name, some in known.groupby("class", sort=False):
        weights = np.full(len(some), 100 / len(some))
        label = f"{name} ({len(some)} units, mean {some['slope'].mean():.2f})"
        colour = CLASS_COLOURS[str(name)]
        axes.hist(some["slope"], bins=bins, weights=weights, alpha=0.6, color=colour, label=label)
    axes.axvline(0, color=GREY, lw=0.8)
    axes.set_xlabel("slope of ln rate over ln speed (0: speed changes nothing; 1: in proportion)")
    axes.set_ylabel("units of the class (%)")
    axes.legend(loc="upper right")
    return figure


@styled
def stretch_figure(matched: pd.DataFrame, source: str) -> Figure:
    """Draw matches of trains across speeds; see `spikes.analysis.speed.match_by_class`."""
    title = "Trains matched to their texture at another speed"
    figure = new_figure(6.4, 2.9, title, source)
    axes = figure.subplots()
    names = list(dict.fromkeys(matched["class"]))
    for shift, stretched, alpha in ((-0.2, False, 0.35), (0.2, True, 1.0)):
        some = matched[matched["stretched"] == stretched].set_index("class").loc[names]
        mean, low, high = (100 * some[name].to_numpy() for name in ("accuracy", "low", "high"))
        label = "stretched by the ratio of the speeds" if stretched else "as they are"
        at = np.arange(len(names)) + shift
        error = np.nan_to_num([mean - low, high - mean])
        colours = [CLASS_COLOURS[name] for name in names]
        drawn = axes.bar(at, mean, 0.36, color=colours, alpha=alpha, yerr=error,
                         error_kw={"lw": 0.8})  # fmt: skip
        for bar, percent in zip(drawn, mean, strict=True):
            axes.annotate(f"{percent:.0f}", (bar.get_x() + 0.05, percent), ha="left", va="bottom")
        axes.plot([], [], "s", color=GREY, alpha=alpha, label=label)
    draw_chance(axes, float(matched["chance"].iloc[0]))
    percent_axes(axes, "")
    axes.set_xticks(range(len(names)), names)
    axes.set_ylabel("textures found (%)")
    axes.legend(loc="upper right", fontsize=7)
    return figure

"""Figures of spikes: what fires, what texture is read from, what speed does."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from afferents.reporting.style import (
    BLUE,
    GREY,
    ORANGE,
    VERMILION,
    draw_chance,
    new_figure,
    percent_axes,
    styled,
)
from afferents.spikes.population import Spikes

CLASS_COLOURS = {"SA": BLUE, "RA": ORANGE, "PC": VERMILION}
ACROSS = {"speeds": "a speed not learnt from", "windows": "a speed learnt from"}
"""What is held out, in words, in the order of the panels."""


def accuracy_axes(axes: Axes, title: str, x: str) -> None:
    """Make a panel of accuracy in percent over a logarithmic axis."""
    percent_axes(axes, title)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(x)
    axes.set_ylabel("windows named rightly (%)")


# A raster: every spike of some units in a stretch of a few trials.


@styled
def raster_figure(spikes: Spikes, source: str) -> Figure:
    """Draw the spikes of a few trials, a panel a trial, a row a unit."""
    height = 0.8 + 0.055 * max(spikes.n_units, 12)
    figure = new_figure(2.9 * spikes.n_trials + 1.0, height, "Spikes", source)
    panels = figure.subplots(1, spikes.n_trials, sharey=True, squeeze=False)[0]
    classes = spikes.units["class"].to_numpy(str)
    for trial, axes in enumerate(panels):
        trains = [1e3 * spikes.train(trial, unit) for unit in range(spikes.n_units)]
        colours = [CLASS_COLOURS[name] for name in classes]
        axes.eventplot(trains, colors=colours, linewidths=0.6, linelengths=0.8)
        row = spikes.trials.iloc[trial]
        axes.set_title(
            f"{row['texture']}, {row['speed_mm_s']:g} mm/s", loc="left", fontweight="bold"
        )
        axes.set_xlim(0, 1e3 * row["duration_s"])
        axes.set_xlabel("time (ms)")
    middles = [float(np.mean(np.flatnonzero(classes == name))) for name in dict.fromkeys(classes)]
    panels[0].set_yticks(middles, list(dict.fromkeys(classes)))
    panels[0].set_ylim(spikes.n_units - 0.5, -0.5)
    return figure


# How well texture is read from spikes, by temporal resolution and by the number of units.


@styled
def resolution_figure(found: pd.DataFrame, source: str) -> Figure:
    """Draw accuracy against the width of bins; see `neuro.accuracy_by_resolution`."""
    parts = [part for part in ACROSS if (found["across"] == part).any()]
    n_units = int(found["n_units"].max())
    title = f"Texture read from spikes, by temporal resolution (at most {n_units} units a class)"
    figure = new_figure(4.2 * len(parts) + 0.6, 3.2, title, source)
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for part, axes in zip(parts, panels, strict=True):
        for name, some in found[found["across"] == part].groupby("class", sort=False):
            x = 1e3 * some["resolution_s"]
            _line(axes, x.to_numpy(), some, str(name), CLASS_COLOURS[str(name)], "-")
        draw_chance(axes, float(found["chance"].iloc[0]))
        accuracy_axes(axes, f"At {ACROSS[part]}", "width of a bin (ms); the widest is the rate")
    panels[0].legend(loc="upper left", ncols=4, columnspacing=1.0, handlelength=1.4)
    return figure


@styled
def units_figure(found: pd.DataFrame, source: str) -> Figure:
    """Draw accuracy against the number of units; see `neuro.accuracy_by_units`."""
    parts = [part for part in ACROSS if (found["across"] == part).any()]
    title = "Texture read from spikes, by number of units"
    figure = new_figure(4.2 * len(parts) + 0.6, 3.2, title, source)
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for part, axes in zip(parts, panels, strict=True):
        here = found[found["across"] == part]
        for (name, code), some in here.groupby(["class", "code"], sort=False):
            style = "-" if code == "timing" else ":"
            label = f"{name}, {'with timing' if code == 'timing' else 'rates'}"
            x = some["n_units"].to_numpy()
            _line(axes, x, some, label, CLASS_COLOURS[str(name)], style)
        draw_chance(axes, float(found["chance"].iloc[0]))
        accuracy_axes(axes, f"At {ACROSS[part]}", "units")
    panels[0].legend(loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.8)
    return figure


def _line(axes: Axes, x: object, some: pd.DataFrame, label: str, colour: str, style: str) -> None:
    """Draw a line of percent, with its interval as a band."""
    mean, low, high = (100 * some[name].to_numpy() for name in ("accuracy", "low", "high"))
    axes.plot(x, mean, style, color=colour, marker="o", ms=3, label=label)  # type: ignore[arg-type]
    axes.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)  # type: ignore[arg-type]


# What speed does to spikes: slopes of rates, and trains matched across speeds.


@styled
def slope_figure(slopes: pd.DataFrame, source: str) -> Figure:
    """Draw how units' rates grow with speed; see `neuro.rate_slopes`."""
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
    """Draw matches of trains across speeds; see `neuro.speed.match_by_class`."""
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


# Artificial units beside natural fibres: what is read from each, and whether trains stretch.

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

"""What was read from spikes, for people: figures, and three tables."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from afferents.neuro import decoding, exponent, speed
from afferents.reporting import style
from afferents.reporting.tables import make_table
from afferents.spikes.population import CLASSES, Spikes

CLASS_COLOURS = {"SA": style.BLUE, "RA": style.ORANGE, "PC": style.VERMILION}
ACROSS = {"speeds": "a speed not learnt from", "windows": "a speed learnt from"}
"""What is held out, in words, in the order of the panels."""


_STYLES = {"timing": "-", "rate": ":", "artificial": "-", "natural": "--"}
"""How lines of each code and of each population are drawn."""
_WORDS = {"timing": "with timing", "rate": "rates"}
SILENT = 0.5
"""Share of a class' units above which a texture at a speed counts as one that leaves it silent."""
_SPEEDS = {"speeds": "held out", "windows": "learnt"}
"""Whether the speed tested was learnt from, by `across` of `accuracy_by_resolution`."""


@style.styled
def raster_figure(spikes: Spikes, source: str) -> Figure:
    """Draw the spikes of a few trials, a panel a trial, a row a unit; grey: not recorded."""
    height = 1.0 + 0.055 * max(spikes.n_units, 24)
    figure = style.new_figure(2.9 * spikes.n_trials + 1.0, height, "Spikes", source)
    panels = figure.subplots(1, spikes.n_trials, sharey=True, squeeze=False)[0]
    classes = spikes.units["class"].to_numpy(str)
    for trial, axes in enumerate(panels):
        trains = [1e3 * spikes.train(trial, unit) for unit in range(spikes.n_units)]
        colours = [CLASS_COLOURS[name] for name in classes]
        axes.eventplot(trains, colors=colours, linewidths=0.6, linelengths=0.8)
        for unit in np.flatnonzero(~spikes.recorded[trial]):
            axes.axhspan(unit - 0.5, unit + 0.5, color=style.GREY, alpha=0.25, lw=0)
        row = spikes.trials.iloc[trial]
        title = f"{row['texture']}, {row['speed_mm_s']:g} mm/s"
        axes.set_title(title, loc="left", fontweight="bold")
        axes.set(xlim=(0, 1e3 * row["duration_s"]), xlabel="time (ms)")
    middles = [float(np.mean(np.flatnonzero(classes == name))) for name in dict.fromkeys(classes)]
    panels[0].set_yticks(middles, list(dict.fromkeys(classes)))
    panels[0].set_ylim(spikes.n_units - 0.5, -0.5)
    return figure


@style.styled
def accuracy_figure(found: pd.DataFrame, source: str) -> Figure:
    """Draw accuracy against the width of bins, or of codes against the number of units.

    Parameters
    ----------
    found
        As `neuro.accuracy_by_resolution` or `neuro.accuracy_by_units` gives it.
    """
    of_codes, most = "code" in found, int(found["n_units"].max())
    kind = "number of units" if of_codes else f"temporal resolution (at most {most} units a class)"
    x = "units" if of_codes else "width of a bin (ms); the widest is the rate"
    title = f"Texture read from spikes, by {kind}"
    parts = [part for part in ACROSS if (found["across"] == part).any()]
    figure = style.new_figure(4.2 * len(parts) + 0.6, 3.2, title, source)
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for part, axes in zip(parts, panels, strict=True):
        _draw_accuracy(axes, found[found["across"] == part], x, "code" if of_codes else "across")
    panels[0].legend(loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.8)
    return figure


def _draw_accuracy(axes: Axes, found: pd.DataFrame, x: str, by: str) -> None:
    """Draw accuracy in percent with its intervals, a line for each class and each kind in `by`."""
    for (name, kind), some in found.groupby(["class", by], sort=False):
        label = str(name) if by == "across" else f"{name}, {_WORDS.get(str(kind), kind)}"
        at = some["n_units"] if x == "units" else 1e3 * some["resolution_s"]
        mean, low, high = (100 * some[one] for one in ("accuracy", "low", "high"))
        colour, drawn = CLASS_COLOURS[str(name)], _STYLES.get(str(kind), "-")
        axes.plot(at, mean, drawn, color=colour, marker="o", ms=3, label=label)
        axes.fill_between(at, low, high, color=colour, alpha=0.12, lw=0)
    style.draw_chance(axes, float(found["chance"].iloc[0]))
    style.percent_axes(axes, f"At {ACROSS[found['across'].iloc[0]]}")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(xlabel=x, ylabel="windows recognised (%)")


@style.styled
def slope_figure(slopes: pd.DataFrame, source: str) -> Figure:
    """Draw how units' rates grow with speed; see `neuro.rate_slopes`."""
    figure = style.new_figure(6.4, 2.9, "How firing rates grow with speed", source)
    axes = figure.subplots()
    known = slopes.dropna(subset=["slope"])
    low, high = (known["slope"].min(), known["slope"].max()) if len(known) else (0.0, 1.0)
    bins = np.linspace(float(low), float(high), 30).tolist()
    for name, some in known.groupby("class", sort=False):
        weights = np.full(len(some), 100 / len(some))
        label = f"{name} ({len(some)} units, mean {some['slope'].mean():.2f})"
        colour = CLASS_COLOURS[str(name)]
        axes.hist(some["slope"], bins=bins, weights=weights, alpha=0.6, color=colour, label=label)
    axes.axvline(0, color=style.GREY, lw=0.8)
    axes.set_xlabel("slope of ln rate over ln speed (0: speed changes nothing; 1: in proportion)")
    axes.set_ylabel("units of the class (%)")
    axes.legend(loc="upper right")
    return figure


@style.styled
def stretch_figure(matched: pd.DataFrame, source: str) -> Figure:
    """Draw matches of trains across speeds; see `neuro.speed.match_by_class`."""
    title = "Trains matched to their texture at another speed"
    figure = style.new_figure(6.4, 2.9, title, source)
    _draw_matches(figure.subplots(), matched.assign(population="artificial"), "")
    return figure


@style.styled
def comparison_figure(resolution: pd.DataFrame, matches: pd.DataFrame, source: str) -> Figure:
    """Draw decoding by resolution and matches across speeds, of both populations.

    Parameters
    ----------
    resolution, matches
        As `accuracy_by_resolution` and `match_by_class` give them, with a column `population` more:
        ``artificial`` or ``natural``.
    """
    figure = style.new_figure(11.5, 3.3, "Artificial units and natural fibres", source)
    *panels, bars = figure.subplots(1, 3)
    for (_, here), axes in zip(resolution.groupby("across"), panels, strict=False):
        _draw_accuracy(axes, here, "width of a bin (ms)", "population")
    panels[0].legend(loc="upper left", fontsize=6.5, ncols=2)
    _draw_matches(bars, matches, "Trains matched across speeds")
    return figure


def _draw_matches(axes: Axes, matches: pd.DataFrame, title: str) -> None:
    """Draw bars of each class, for each population as trains are and stretched."""
    names = list(matches["class"].unique())
    kinds = matches.groupby(["population", "stretched"])
    step = 0.8 / len(kinds)
    for number, ((population, stretched), found) in enumerate(kinds):
        some = found.set_index("class").reindex(names)
        mean, low, high = (100 * some[one].to_numpy() for one in ("accuracy", "low", "high"))
        drawn = axes.bar(
            np.arange(len(names)) + (number - (len(kinds) - 1) / 2) * step, mean, 0.9 * step,
            color=[CLASS_COLOURS[name] for name in names], alpha=1.0 if bool(stretched) else 0.35,
            hatch="///" if population == "natural" else "", edgecolor="white", lw=0,
            yerr=np.nan_to_num([mean - low, high - mean]), error_kw={"lw": 0.8},
        )  # fmt: skip
        for bar, percent in zip(drawn, np.nan_to_num(mean), strict=True):
            axes.annotate(f"{percent:.0f}", (bar.get_x(), percent), va="bottom", fontsize=6.5)
    shown = {"as they are": (0.35, ""), "stretched by their ratio": (1.0, "")}
    if len(kinds) > 2:
        shown["natural"] = (0.6, "///")
    for label, (alpha, hatch) in shown.items():
        axes.bar(
            [0], [0], color=style.GREY, alpha=alpha, hatch=hatch, edgecolor="white", label=label
        )
    style.draw_chance(axes, float(matches["chance"].iloc[0]))
    style.percent_axes(axes, title)
    axes.set_xticks(range(len(names)), names)
    axes.set_ylabel("textures found (%)")
    axes.legend(loc="upper right", fontsize=6.5)


def summarise_rates(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return rates, how they grow with speed, and silence, a row a class.

    Parameters
    ----------
    tables
        As `neural` returns them; here and below, those of natural fibres may be missing.
    """
    populations = {"artificial": "rates", "natural": "natural_rates"}
    rows = []
    for who in (who for who, name in populations.items() if name in tables):
        of_class = dict(list(tables[populations[who]].groupby("class")))
        for name in (name for name in CLASSES if name in of_class):
            rates, silent = of_class[name]["spikes_per_s"], of_class[name]["silent"] > SILENT
            low, high = rates.quantile([0.1, 0.9])
            cells = [who, name, f"{rates.mean():.0f}", f"{low:.0f} to {high:.0f}", None]
            slopes = tables["slopes"].loc[tables["slopes"]["class"] == name, "slope"]
            if who == "artificial" and slopes.count() > 1:
                cells[-1] = f"{slopes.mean():.2f} ± {slopes.std():.2f}"
            rows.append([*cells, f"{silent.sum()} of {len(silent)}"])
    return make_table(
        "Rates: spikes/s, their growth with speed (power ± SD of units), and silence",
        "Over textures and speeds; silent: most units of the class never fire there.",
        ("Spikes", "Class", "Mean", "Middle 80%", "Power of speed", "Silent"),
        rows,
        n_headers=2,
    )


def summarise_decoding(tables: Mapping[str, pd.DataFrame], whole: str) -> pd.DataFrame:
    """Return how well texture is read from rates and from bins, a row a class and population.

    Parameters
    ----------
    whole
        What `without_gaps` kept of natural fibres, or why they can't be decoded.
    """
    found = tables["resolution"].assign(population="artificial")
    note = f"Windows of {found['resolution_s'].max():.2g} s"
    if "beside_resolution" in tables:
        both = tables["beside_resolution"]
        found = pd.concat([found, both.assign(population="matched " + both["population"])])
        note += f", of matched populations {both['resolution_s'].max():.2g} s"
    notes = [f"{note}. The best bin is chosen on what is tested, which flatters it.", whole]
    if right := exponent.accuracy_by_exponent(tables["exponents"]):
        share = decoding.mean_with_interval(right)["accuracy"]
        n = tables["exponents"]["texture"].nunique()
        notes.append(
            f"The spectral exponent of the vibration alone recognises {share:.0%} of recordings at "
            f"a speed held out (chance {1 / n:.0%})."
        )
    found["class"] = pd.Categorical(found["class"], CLASSES)
    rows = []
    for keys, some in found.groupby(["class", "across", "population"], observed=True):
        name, across, who = map(str, keys)
        by_width = some.sort_values("resolution_s", ascending=False)
        rate, best = by_width.iloc[0], by_width.iloc[int(by_width["accuracy"].argmax())]
        ms, chance = f"{1e3 * best['resolution_s']:.3g}", f"{100 * rate['chance']:.0f}"
        rows.append([name, _SPEEDS[across], who, _percent(rate), _percent(best), ms, chance])
    return make_table(
        "Texture read from spikes: windows recognised, % [95% over speeds]",
        " ".join(filter(None, notes)),
        ("Class", "Speed", "Spikes", "Rate", "Best bin", "Bin, ms", "Chance"),
        rows,
        n_headers=3,
    )


def summarise_stretching(tables: Mapping[str, pd.DataFrame], matched: str) -> pd.DataFrame:
    """Return how often trains find their texture at another speed, populations side by side.

    Parameters
    ----------
    matched
        What was made alike of both populations.
    """
    found = {"Artificial": speed.match_by_class(tables["stretch"])}
    if "beside_stretch" in tables:
        both = tables["beside_stretch"]
        for who in ("artificial", "natural"):
            found[f"Matched {who}"] = both[both["population"] == who]
        found["Natural"] = tables["natural_stretch"]
    rows = []
    for name in CLASSES:
        cells: dict[str, list[str]] = {}
        for head, matches in found.items():
            some = matches[matches["class"] == name].sort_values("stretched", ascending=False)
            if len(some):
                n = some[["n_units", "n_textures"]].max().map(str)
                chance = f"{100 * some['chance'].iloc[0]:.0f}"
                cells[head] = [*(_percent(row) for _, row in some.iterrows()), chance, *n]
        for at, what in enumerate(("stretched", "as is", "chance", "units", "textures")):
            if cells:
                of_all = (cells[head][at] if head in cells else None for head in found)
                rows.append([name, what, *of_all])
    return make_table(
        "Trains that find their texture at another speed, % [95% over speeds]",
        matched,
        ("Class", "Trains", *found),
        rows,
        n_headers=2,
    )


def _percent(row: pd.Series) -> str:
    """Return the accuracy of a row in percent, with its 95% interval where there is one."""
    mean, low, high = (100 * float(row[name]) for name in ("accuracy", "low", "high"))
    return f"{mean:.0f}" + (f" [{low:.0f}, {high:.0f}]" if high > low else "")

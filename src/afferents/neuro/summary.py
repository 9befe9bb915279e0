"""What was read from spikes, in three tables for people: rates, decoding, and stretching."""

from collections.abc import Mapping

import pandas as pd

from afferents.neuro.decoding import mean_with_interval
from afferents.neuro.exponent import accuracy_by_exponent
from afferents.neuro.speed import match_by_class
from afferents.reporting.tables import make_table
from afferents.spikes.population import CLASSES

SILENT = 0.5
"""Share of a class' units above which a texture at a speed counts as one that leaves it silent."""
_SPEEDS = {"speeds": "held out", "windows": "learnt"}
"""Whether the speed tested was learnt from, by `across` of `accuracy_by_resolution`."""


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
    if right := accuracy_by_exponent(tables["exponents"]):
        share, n = mean_with_interval(right)["accuracy"], tables["exponents"]["texture"].nunique()
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
    found = {"Artificial": match_by_class(tables["stretch"])}
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

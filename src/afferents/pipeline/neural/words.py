"""What the tables of spikes mean, in sentences."""

from collections.abc import Mapping

import pandas as pd

from afferents.spikes.analysis import told_by_exponent
from afferents.spikes.analysis.decoding import summary
from afferents.spikes.analysis.speed import match_by_class

SILENT = 0.5
"""Share of a class' units above which a recording counts as one that leaves it silent."""


def sentences_of(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Return what was found, a sentence each: rates, codes, speed, and what stays silent."""
    return [
        *_rates(tables["rates"]),
        *_codes(tables["resolution"]),
        *_stretched(tables["stretch"]),
        *_slopes(tables["slopes"]),
        *_exponents(tables["exponents"]),
    ]


def _rates(rates: pd.DataFrame) -> list[str]:
    said = []
    for name, some in rates.groupby("class", sort=False):
        low, high = some["spikes_per_s"].quantile([0.1, 0.9])
        said.append(
            f"{name} units fire {some['spikes_per_s'].mean():.0f} spikes/s in the mean; of the "
            f"recordings, the middle four fifths lie between {low:.0f} and {high:.0f}."
        )
        silent = some[some["silent"] > SILENT]
        if len(silent):
            where = [f"{row.texture}/{row.speed_mm_s:g}" for row in silent.itertuples()]
            shown = ", ".join(where[:6]) + (f" and {len(where) - 6} more" if len(where) > 6 else "")
            said.append(f"Most {name} units are silent in {shown} (texture/speed).")
    return said


def _codes(found: pd.DataFrame) -> list[str]:
    said = []
    for (name, across), some in found.groupby(["class", "across"], sort=False):
        by = some.set_index("resolution_s")["accuracy"]
        best_s, rate = float(by.index.to_numpy()[by.argmax()]), by.loc[by.index.max()]
        where = "not learnt from" if across == "speeds" else "learnt from"
        said.append(
            f"{name}, at a speed {where}: rates alone tell {100 * rate:.0f}% of the windows, bins "
            f"of {1e3 * best_s:g} ms {100 * by.max():.0f}% (chance "
            f"{100 * some['chance'].iloc[0]:.0f}%)."
        )
    return said


def _stretched(matches: pd.DataFrame) -> list[str]:
    found = match_by_class(matches).pivot_table("accuracy", "class", "stretched", sort=False)
    return [
        f"{name} trains find their texture at another speed in {100 * stretched:.0f}% of cases "
        f"when stretched by the ratio of the speeds, in {100 * plain:.0f}% as they are."
        for name, stretched, plain in zip(found.index, found[True], found[False], strict=True)
    ]


def _slopes(slopes: pd.DataFrame) -> list[str]:
    return [
        f"{name} rates grow with speed to the power {some['slope'].mean():.2f}, with a standard "
        f"deviation of {some['slope'].std():.2f} over units."
        for name, some in slopes.groupby("class", sort=False)
        if some["slope"].notna().sum() > 1
    ]


def _exponents(table: pd.DataFrame) -> list[str]:
    right = told_by_exponent(table)
    if not right:
        return []
    chance = 100 / table["texture"].nunique()
    return [
        f"The spectral exponent of the vibration alone, one number, tells "
        f"{100 * summary(right)['accuracy']:.0f}% of the recordings at a speed not learnt from "
        f"(chance {chance:.0f}%)."
    ]

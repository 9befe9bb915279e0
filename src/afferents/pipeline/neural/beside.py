"""Artificial units beside natural fibres, made alike: `afferents neural --natural`."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from afferents.core.errors import InputError
from afferents.reporting.neural import beside_figure
from afferents.spikes.analysis import accuracy_by_resolution, matched, stretch_match
from afferents.spikes.analysis.speed import match_by_class
from afferents.spikes.population import Spikes

_SHARE = 1 / 3
"""Of the shortest trial: the longest window that still leaves some to learn from."""


@dataclass(frozen=True)
class Beside:
    """What both populations say, with a column `population`: ``artificial`` or ``natural``.

    `matches` has both made alike, `natural` all fibres on all textures. `resolution` and `figure`
    are None where no fibre was recorded in every trial.
    """

    resolution: pd.DataFrame | None
    matches: pd.DataFrame
    natural: pd.DataFrame
    figure: Figure | None
    sentences: list[str]


def beside(artificial: Spikes, natural: Spikes, window_s: float, seed: int, source: str) -> Beside:
    """Read texture from both, from as many textures, speeds, units and seconds of each.

    Trains are matched across speeds with what was recorded; decoding needs units that were
    recorded in every trial.

    Raises
    ------
    InputError
        As `spikes.analysis.matched`, and if trials are too short for windows.
    """
    names = ("artificial", "natural")
    pair = dict(zip(names, matched(artificial, natural, seed, gaps=True), strict=True))
    both = pd.concat(
        match_by_class(stretch_match(one, seed=seed)).assign(population=population)
        for population, one in pair.items()
    )
    alone = match_by_class(stretch_match(natural, n_units=None, seed=seed))
    sentences = [compared(pair), *matches_in_words(both), *all_fibres_in_words(alone)]
    try:
        whole = dict(zip(names, matched(artificial, natural, seed), strict=True))
    except InputError as gaps:
        said = f"Texture can't be decoded from the fibres' rates and bins ({gaps})."
        return Beside(None, both, alone, None, [*sentences, said])
    shortest = min(float(one.trials["duration_s"].min()) for one in whole.values())
    window_s = min(window_s, shortest * _SHARE)
    resolution = pd.concat(
        accuracy_by_resolution(one, window_s=window_s, seed=seed).assign(population=population)
        for population, one in whole.items()
    )
    return Beside(resolution, both, alone, beside_figure(resolution, both, source), sentences)


def compared(pair: Mapping[str, Spikes]) -> str:
    """Return what was made alike."""
    one = pair["natural"]
    units = ", ".join(f"{n} {name}" for name, n in one.units["class"].value_counts().items())
    speeds = {
        name: ", ".join(f"{speed:g}" for speed in sorted(spikes.trials["speed_mm_s"].unique()))
        for name, spikes in pair.items()
    }
    return (
        f"Compared: {one.trials['texture'].nunique()} textures of each; {units} of each; "
        f"{speeds['artificial']} mm/s beside {speeds['natural']} mm/s; of the natural trials "
        f"{100 * (1 - one.recorded.mean()):.0f}% were not recorded."
    )


def matches_in_words(matches: pd.DataFrame) -> list[str]:
    """Return what stretching does to trains of both populations; as `match_by_class` has it."""
    said = []
    for (name, population), some in matches.groupby(["class", "population"], sort=False):
        by = some.set_index("stretched")["accuracy"]
        said.append(
            f"{name}, {population}: {100 * by[True]:.0f}% of textures are found by their trains at "
            f"another speed when stretched, {100 * by[False]:.0f}% as they are (chance "
            f"{100 * some['chance'].iloc[0]:.0f}%)."
        )
    return said


def all_fibres_in_words(matches: pd.DataFrame) -> list[str]:
    """Return the same of all natural fibres, and how much was recorded of them."""
    said = []
    for name, some in matches.groupby("class", sort=False):
        by, one = some.set_index("stretched")["accuracy"], some.iloc[0]
        said.append(
            f"All {one['n_units']} natural {name} fibres, on {one['n_textures']} textures with the "
            f"gaps they have (up to {one['n_trains']} trains a pair of speeds): "
            f"{100 * by[True]:.0f}% of textures are found when stretched, "
            f"{100 * by[False]:.0f}% as they are (chance {100 * one['chance']:.0f}%)."
        )
    return said

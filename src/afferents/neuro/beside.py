"""Two populations made alike, so that what is read from them can be compared.

Artificial and natural recordings differ in how many textures, speeds, repetitions, units and
seconds they have; more of any makes reading easier or harder. As many of each are kept as both
have.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.neuro.decoding import (
    accuracy_by_resolution,
    code_sentences,
    require_conditions,
    some_units,
)
from afferents.neuro.figures import beside_figure
from afferents.neuro.gaps import left_out, without_gaps
from afferents.neuro.speed import match_by_class, match_sentences, stretch_match
from afferents.spikes.population import Spikes, joined

_PLACE = ["texture", "speed_mm_s"]
_MOST_SPEEDS = 4
"""Whose ratios are matched."""


def matched(
    first: Spikes, second: Spikes, seed: int = 0, gaps: bool = False
) -> tuple[Spikes, Spikes]:
    """Return two populations with as many textures, speeds, repetitions, units and seconds.

    Classes that one of them lacks are left out. Speeds are chosen so that their ratios are as alike
    as can be (30, 60 and 90 mm/s beside 40, 80 and 120). Textures and units are drawn with the
    seed: textures that most units were recorded on first, and units that were recorded on all.
    Textures need not be the same ones: only their number counts. Of repetitions, those that most
    units were recorded in come first.

    Parameters
    ----------
    gaps
        Whether units stay that were not recorded in every trial. Analyses that compare what two
        trials both have can bear them; decoding can't. Then seconds are made alike speed by speed,
        so that the slow trials of one, which are longer, keep their length.

    Raises
    ------
    InputError
        If they have no class in common, or one has fewer than two textures or speeds, or trials
        without a speed.
    """
    both = [name for name in first.units["class"].unique() if name in set(second.units["class"])]
    if not both:
        found = " and ".join(", ".join(one.units["class"].unique()) for one in (first, second))
        raise InputError(
            f"natural: expected units of a class that the artificial ones have, found {found}"
        )
    speeds = alike(require_conditions(first), require_conditions(second))
    parts = [_at(one.of_class(*both), at) for one, at in zip((first, second), speeds, strict=True)]
    n_textures = min(len(_textures(part, seed)) for part in parts)
    if n_textures < 2:
        raise InputError(
            f"natural: expected 2 textures or more at the speeds compared, found {n_textures}"
        )
    parts = [_of_textures(part, _textures(part, seed)[:n_textures], gaps) for part in parts]
    n_repetitions = min(int(part.trials.groupby(_PLACE).size().min()) for part in parts)
    parts = [_repeated(part, n_repetitions) for part in parts]
    n_units = {name: min(part.of_class(name).n_units for part in parts) for name in both}
    if not any(n_units.values()):
        raise InputError(
            "natural: expected units that were recorded in every trial compared, found none"
        )
    here, there = (some_of_each(part, n_units, seed) for part in parts)
    return _as_long(here, there, by_speed=gaps)


def alike(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return as many speeds of each as both have, whose ratios differ least.

    Where several do, those that are nearest to each other.
    """
    n = min(len(first), len(second), _MOST_SPEEDS)

    def unlike(pair: tuple[tuple[float, ...], tuple[float, ...]]) -> tuple[float, float]:
        apart = np.log(pair[0]) - np.log(pair[1])
        return round(float(np.ptp(apart)), 6), float(abs(apart.mean()))  # ratios, then the speeds

    pairs = [(a, b) for a in combinations(first, n) for b in combinations(second, n)]
    here, there = min(pairs, key=unlike)
    return np.array(here), np.array(there)


def _at(spikes: Spikes, speeds: NDArray[np.float64]) -> Spikes:
    return spikes.select(trials=spikes.trials["speed_mm_s"].isin(speeds).to_numpy())


def _textures(spikes: Spikes, seed: int) -> list[str]:
    """Return the textures that are there at every speed, those with fewest gaps first."""
    there = spikes.trials.groupby("texture")["speed_mm_s"].nunique()
    everywhere = there.index[there == there.max()].to_numpy(str)
    np.random.default_rng(seed).shuffle(everywhere)
    texture = spikes.trials["texture"].to_numpy(str)
    gaps = [np.sum(~spikes.recorded[texture == one]) for one in everywhere]
    return [str(everywhere[place]) for place in np.argsort(gaps, kind="stable")]


def _of_textures(spikes: Spikes, textures: list[str], gaps: bool) -> Spikes:
    """Return some textures, and the units that were recorded in all (or any) of their trials."""
    kept = spikes.select(trials=spikes.trials["texture"].isin(textures).to_numpy())
    there = kept.recorded
    return kept.select(units=there.any(axis=0) if gaps else there.all(axis=0))


def _repeated(spikes: Spikes, n: int) -> Spikes:
    """Return so many repetitions of each texture at each speed, those with fewest gaps first."""
    gaps = pd.Series((~spikes.recorded).sum(axis=1)).sort_values(kind="stable")
    first = spikes.trials.loc[gaps.index].groupby(_PLACE).head(n)
    kept = spikes.select(trials=np.sort(first.index))
    numbers = kept.trials.groupby(_PLACE).cumcount()
    return replace(kept, trials=kept.trials.assign(repetition=numbers))


def _as_long(first: Spikes, second: Spikes, by_speed: bool) -> tuple[Spikes, Spikes]:
    """Return both with trials as long as the shortest, of all or of a speed and its counterpart."""
    if not by_speed:
        length_s = min(float(one.trials["duration_s"].min()) for one in (first, second))
        return first.window(0, length_s), second.window(0, length_s)
    pairs = []
    for speeds in zip(
        *(np.unique(one.trials["speed_mm_s"]) for one in (first, second)), strict=True
    ):
        here, there = (
            one.select(trials=(one.trials["speed_mm_s"] == speed).to_numpy())
            for one, speed in zip((first, second), speeds, strict=True)
        )
        pairs.append(_as_long(here, there, by_speed=False))
    here_all, there_all = (joined(parts) for parts in zip(*pairs, strict=True))
    return here_all, there_all


def some_of_each(spikes: Spikes, n_units: dict[str, int], seed: int) -> Spikes:
    """Return so many units of each class, drawn with the seed."""
    rng = np.random.default_rng(seed)
    units = [
        spikes.units.index.get_indexer(some_units(spikes.of_class(name), n, rng).units.index)
        for name, n in n_units.items()
    ]
    return spikes.select(units=np.concatenate(units))


# Artificial units beside natural fibres, made alike: `afferents neural --natural`.

_SHARE = 1 / 3
"""Of the shortest trial: the longest window that still leaves some to learn from."""
_ALL = (
    "All {n_units} natural {class} fibres, on {n_textures} textures with the gaps they have (up to "
    "{n_trains} trains a pair of speeds),"
)


class Beside(NamedTuple):
    """What both populations say.

    Attributes
    ----------
    tables
        `beside_stretch` has both made alike, `natural_stretch` all fibres on all textures, and
        `beside_resolution` what is read from both, if anything is left of `without_gaps`. Those
        of both have a column `population`: ``artificial`` or ``natural``.
    figures
        `beside`, if anything is.
    """

    tables: dict[str, pd.DataFrame]
    figures: dict[str, Figure]
    sentences: list[str]


def beside(artificial: Spikes, natural: Spikes, window_s: float, seed: int, source: str) -> Beside:
    """Read texture from both, from as many textures, speeds, repetitions, units and seconds.

    Trains are matched across speeds with what was recorded, texture is decoded from what
    `without_gaps` keeps of it.

    Raises
    ------
    InputError
        As `neuro.matched`, and if trials are too short for windows.
    """
    names = ("artificial", "natural")
    pair = dict(zip(names, matched(artificial, natural, seed, gaps=True), strict=True))
    both = pd.concat(
        match_by_class(stretch_match(one, seed=seed)).assign(population=population)
        for population, one in pair.items()
    )
    alone = match_by_class(stretch_match(natural, n_units=None, seed=seed))
    tables = {"beside_stretch": both, "natural_stretch": alone}
    sentences = [
        compared(pair),
        *match_sentences(both, "{class} trains, {population}, made alike,"),
        *match_sentences(alone, _ALL),
    ]
    try:
        complete = without_gaps(natural)
        whole = dict(zip(names, matched(artificial, complete, seed), strict=True))
    except InputError as gaps:
        said = f"Texture can't be decoded from the fibres' rates and bins ({gaps})."
        return Beside(tables, {}, [*sentences, said])
    shortest = min(float(one.trials["duration_s"].min()) for one in whole.values())
    window_s = min(window_s, shortest * _SHARE)
    read = {
        population: accuracy_by_resolution(one, window_s=window_s, seed=seed)
        for population, one in whole.items()
    }
    for population, found in read.items():
        sentences += code_sentences(found, f"{population}, made alike")
    if complete is not natural:
        sentences.append(left_out(natural, complete))
    resolution = pd.concat(found.assign(population=name) for name, found in read.items())
    tables["beside_resolution"] = resolution
    figures = {"beside": beside_figure(resolution, both, source)}
    return Beside(tables, figures, sentences)


def compared(pair: Mapping[str, Spikes]) -> str:
    """Return what was made alike."""
    one = pair["natural"]
    units = ", ".join(f"{n} {name}" for name, n in one.units["class"].value_counts().items())
    n = int(one.trials.groupby(_PLACE).size().max())
    speeds = {
        name: ", ".join(f"{speed:g}" for speed in sorted(spikes.trials["speed_mm_s"].unique()))
        for name, spikes in pair.items()
    }
    return (
        f"Compared: {one.trials['texture'].nunique()} textures of each; {units} of each; "
        f"{n} repetition{'s' if n > 1 else ''} of each texture and speed; "
        f"{speeds['artificial']} mm/s beside {speeds['natural']} mm/s; of the natural trains "
        f"{100 * (1 - one.recorded.mean()):.0f}% were not recorded."
    )

"""Populations made alike: without gaps, and artificial units compared with natural fibres.

Fibres are recorded one after another, on some textures, more or fewer times. Decoding compares
what all units did, and a unit that was never recorded on a texture gives that texture away. So
textures, units and repetitions are kept that make a whole; nothing is filled in.

Artificial and natural recordings differ in how many textures, speeds, repetitions, units and
seconds they have; more of any makes reading easier or harder. As many of each are kept as both
have.
"""

from dataclasses import replace
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from afferents.errors import InputError
from afferents.neuro.decoding import accuracy_by_resolution, require_conditions, some_units
from afferents.neuro.speed import match_by_class, stretch_match
from afferents.spikes.population import Spikes, joined

_PLACE = ["texture", "speed_mm_s"]
_MOST_SPEEDS = 4
"""Whose ratios are matched."""
_SHARE = 1 / 3
"""Of the shortest trial: the longest window that still leaves some to learn from."""
_OF_A_REPETITION = ("texture", "repetition", "duration_s", "recording")
"""Columns of trials that don't say under which condition a texture was recorded.

Nor does one that differs from trial to trial, which is a number or name of it.
"""


def without_gaps(spikes: Spikes) -> Spikes:
    """Return textures, units and repetitions such that each unit was recorded in every trial.

    Textures and units are left out, the one with the greatest share of gaps first (of equals the
    unit), until each unit has every texture at every speed. Of a texture at a speed there are then
    as many trials as every unit has of every texture, so that chance is one in the number of
    textures. How many a unit must have of a texture, to count as recorded on it, is the number that
    keeps most trains. The first holds each unit's first recorded repetition, and so on. Units that
    were recorded one after another are put together so: correlations between them mean nothing.

    Parameters
    ----------
    spikes
        With gaps; those without come back as they are.

    Returns
    -------
    Spikes
        Trials last as long as the shortest of their texture and speed did.

    Raises
    ------
    InputError
        If fewer than two textures, or no unit, are left.
    """
    names, texture = np.unique(spikes.trials["texture"].to_numpy(str), return_inverse=True)
    by = [
        name
        for name, values in spikes.trials.items()
        if not (name in _OF_A_REPETITION or (name != "speed_mm_s" and values.is_unique))
    ]
    condition = spikes.trials.groupby(by, dropna=False).ngroup().to_numpy()
    counts = np.zeros((len(names), condition.max() + 1, spikes.n_units), np.int64)
    np.add.at(counts, (texture, condition), spikes.recorded)
    least = counts.min(axis=1)
    if spikes.recorded.all() and least.all():
        return spikes
    kept = []
    for number in range(1, int(least.max()) + 1):
        textures, units = _remove_gaps(least >= number)
        if len(textures) > 1 and len(units):
            n = counts[textures][:, :, units].min(axis=(0, 2))
            kept.append((len(textures) * len(units) * n.sum(), textures, units, n))
    if not kept:
        other = [f"'{name}'" for name in by if name != "speed_mm_s"]
        columns = f", or drop columns of trials that are no conditions ({', '.join(other)})"
        raise InputError(
            "spikes: expected a unit that was recorded on 2 textures or more at every speed, found "
            f"none; leave out a speed{columns if other else ''}"
        )
    _, textures, units, n = max(kept, key=lambda one: one[0])
    parts = []
    for one, (at, number) in product(textures, enumerate(n)):
        repeated = spikes.select((texture == one) & (condition == at), units)
        alike = repeated.window(0, float(repeated.trials["duration_s"].min()))
        # the first `number` repetitions of each unit, as trials of all units
        places = np.stack([np.flatnonzero(there)[:number] for there in alike.recorded.T], axis=1)
        trains = [[alike.train(place, unit) for unit, place in enumerate(row)] for row in places]
        trials = alike.trials.iloc[:number].drop(columns="recording", errors="ignore")
        trials = trials.assign(repetition=range(number))
        parts.append(Spikes.unchecked(trains, alike.units, trials))
    return joined(parts)


def left_out(before: Spikes, after: Spikes) -> str:
    """Return in a sentence what `without_gaps` kept: fibres, textures, repetitions and trains.

    A train is one unit in one trial.
    """
    classes = before.units["class"].unique()
    units = ", ".join(
        f"{after.of_class(name).n_units} of {before.of_class(name).n_units} {name}"
        for name in classes
    )
    n_textures = [one.trials["texture"].nunique() for one in (after, before)]
    each = after.trials.groupby("speed_mm_s", dropna=False).size() / n_textures[0]
    repetitions = ", ".join(f"{n:g} at {speed:g} mm/s" for speed, n in each.items())
    return (
        f"Without gaps: {units} units, {n_textures[0]} of {n_textures[1]} textures, repetitions "
        f"{repetitions}; {after.recorded.sum()} of {before.recorded.sum()} recorded trains."
    )


def _remove_gaps(there: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows and columns that are left when none of them has a gap any more."""
    rows, columns = (np.arange(n) for n in there.shape)
    while (gaps := ~there[np.ix_(rows, columns)]).any():
        of_row, of_column = gaps.mean(axis=1), gaps.mean(axis=0)
        if of_row.max() > of_column.max():
            rows = np.delete(rows, of_row.argmax())
        else:
            columns = np.delete(columns, of_column.argmax())
    return rows, columns


class Comparison(NamedTuple):
    """What is read from artificial units and from natural fibres.

    Attributes
    ----------
    tables
        `beside_stretch` has both made alike, `natural_stretch` all fibres on all textures, and
        `beside_resolution` what is read from both, if anything is left of `without_gaps`. Those
        of both have a column `population`: ``artificial`` or ``natural``.
    matched
        What was made alike, in a sentence.
    whole
        What `without_gaps` kept, or why nothing could be decoded; empty where there are no gaps.
    """

    tables: dict[str, pd.DataFrame]
    matched: str
    whole: str


def compare(artificial: Spikes, natural: Spikes, window_s: float, seed: int) -> Comparison:
    """Read texture from both, from as many textures, speeds, repetitions, units and seconds.

    Trains are matched across speeds with what was recorded; texture is decoded from what
    `without_gaps` keeps of it.

    Raises
    ------
    InputError
        As `matched`, and if trials are too short for windows.
    """
    names = ("artificial", "natural")
    pair = matched(artificial, natural, seed, gaps=True)
    both = pd.concat(
        match_by_class(stretch_match(one, seed=seed)).assign(population=name)
        for name, one in zip(names, pair, strict=True)
    )
    alone = match_by_class(stretch_match(natural, n_units=None, seed=seed))
    tables = {"beside_stretch": both, "natural_stretch": alone}
    try:
        complete = without_gaps(natural)
        whole = matched(artificial, complete, seed)
    except InputError as gaps:
        why = f"Texture can't be decoded from the fibres ({gaps})."
        return Comparison(tables, _describe(*pair), why)
    shortest = min(float(one.trials["duration_s"].min()) for one in whole)
    window_s = min(window_s, shortest * _SHARE)
    tables["beside_resolution"] = pd.concat(
        accuracy_by_resolution(one, window_s=window_s, seed=seed).assign(population=name)
        for name, one in zip(names, whole, strict=True)
    )
    kept = "" if complete is natural else left_out(natural, complete)
    return Comparison(tables, _describe(*pair), kept)


def _describe(artificial: Spikes, natural: Spikes) -> str:
    """Return what was made alike."""
    units = ", ".join(f"{n} {name}" for name, n in natural.units["class"].value_counts().items())
    n = int(natural.trials.groupby(_PLACE).size().max())
    speeds = (
        ", ".join(f"{speed:g}" for speed in np.unique(one.trials["speed_mm_s"]))
        for one in (artificial, natural)
    )
    return (
        f"Matched: {natural.trials['texture'].nunique()} textures, {units} units and {n} "
        f"repetition{'s' if n > 1 else ''} of each; {' mm/s with '.join(speeds)} mm/s; "
        f"{100 * (1 - natural.recorded.mean()):.0f}% of the natural trains were not recorded."
    )


def matched(
    first: Spikes, second: Spikes, seed: int = 0, gaps: bool = False
) -> tuple[Spikes, Spikes]:
    """Return two populations with as many textures, speeds, repetitions, units and seconds.

    Classes that one of them lacks are left out. Speeds are chosen so that their ratios are as alike
    as can be (30, 60 and 90 mm/s with 40, 80 and 120). Textures and units are drawn with the
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
    speeds = choose_speeds(require_conditions(first), require_conditions(second))
    parts = [
        _select_speeds(one.of_class(*both), some)
        for one, some in zip((first, second), speeds, strict=True)
    ]
    textures = [_order_textures(part, seed) for part in parts]
    n_textures = min(map(len, textures))
    if n_textures < 2:
        raise InputError(
            f"natural: expected 2 textures or more at the speeds compared, found {n_textures}"
        )
    for place, part in enumerate(parts):
        kept = part.select(part.trials["texture"].isin(textures[place][:n_textures]))
        there = kept.recorded
        parts[place] = kept.select(units=there.any(axis=0) if gaps else there.all(axis=0))
    n_repetitions = min(int(part.trials.groupby(_PLACE).size().min()) for part in parts)
    parts = [_first_repetitions(part, n_repetitions) for part in parts]
    n_units = {name: min(part.of_class(name).n_units for part in parts) for name in both}
    if not any(n_units.values()):
        raise InputError(
            "natural: expected units that were recorded in every trial compared, found none"
        )
    pairs = [[some_of_each(part, n_units, seed) for part in parts]]
    if gaps:
        every = zip(*(np.unique(one.trials["speed_mm_s"]) for one in pairs[0]), strict=True)
        pairs = [list(map(_select_speeds, pairs[0], speed)) for speed in every]
    for pair in pairs:
        length_s = min(float(one.trials["duration_s"].min()) for one in pair)
        pair[:] = [one.window(0, length_s) for one in pair]
    one, other = map(joined, zip(*pairs, strict=True))
    return one, other


def choose_speeds(
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


def _select_speeds(spikes: Spikes, speeds: ArrayLike) -> Spikes:
    return spikes.select(trials=np.isin(spikes.trials["speed_mm_s"], speeds))


def _order_textures(spikes: Spikes, seed: int) -> list[str]:
    """Return the textures that are there at every speed, those with fewest gaps first."""
    there = spikes.trials.groupby("texture")["speed_mm_s"].nunique()
    everywhere = there.index[there == there.max()].to_numpy(str)
    np.random.default_rng(seed).shuffle(everywhere)
    texture = spikes.trials["texture"].to_numpy(str)
    gaps = [np.sum(~spikes.recorded[texture == one]) for one in everywhere]
    return list(map(str, everywhere[np.argsort(gaps, kind="stable")]))


def _first_repetitions(spikes: Spikes, n: int) -> Spikes:
    """Return `n` repetitions of each texture at each speed, those with fewest gaps first."""
    gaps = pd.Series((~spikes.recorded).sum(axis=1)).sort_values(kind="stable")
    first = spikes.trials.loc[gaps.index].groupby(_PLACE).head(n)
    kept = spikes.select(trials=np.sort(first.index))
    numbers = kept.trials.groupby(_PLACE).cumcount()
    return replace(kept, trials=kept.trials.assign(repetition=numbers))


def some_of_each(spikes: Spikes, n_units: dict[str, int], seed: int) -> Spikes:
    """Return `n_units` of each class, drawn with the seed."""
    rng = np.random.default_rng(seed)
    units = [
        spikes.units.index.get_indexer(some_units(spikes.of_class(name), n, rng).units.index)
        for name, n in n_units.items()
    ]
    return spikes.select(units=np.concatenate(units))

"""Populations with gaps: fibres that were recorded one after another, on some textures, so often.

Decoding compares what all units did, and a unit that was never recorded on a texture gives that
texture away. So textures, units and repetitions are kept that make a whole; nothing is filled in.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.spikes.population import Spikes, joined

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

"""What speed does to spikes: rates that grow with it, and trains that it compresses.

A surface that passes at twice the speed shakes the skin in half the time. If spikes follow the
surface, a train at one speed, stretched by the ratio of the speeds, is the train at the other
(Weber et al., PNAS 110:17107, 2013). Rates grow with speed as well, each unit's by a power of its
own (Lieber & Bensmaia, Cereb. Cortex 2020).
"""

from itertools import permutations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.neuro.decoding import mean_with_interval, require_conditions, some_units
from afferents.spikes.population import Spikes

RESOLUTION_S = 0.002
"""Bins that trains are compared in, before smoothing."""
SMOOTHING_MM = 0.3
"""Standard deviation of the smoothing, on the surface: less than the finest bumps are apart."""

_AT_ONCE = 16
"""Trials held against all others at a time: 220 at once would take most of a gigabyte."""


def rate_slopes(spikes: Spikes) -> pd.DataFrame:
    """Return how each unit's rate grows with speed: the slope of ln rate over ln speed.

    A slope of 0 is a rate that speed does not change, 1 one that grows in proportion.

    Returns
    -------
    pandas.DataFrame
        A row a unit: `unit`, `class`, `slope` (mean over textures), `spread` (standard deviation
        over textures), `n_textures` (those at which it fires at two speeds or more). NaN where
        there is none.

    Raises
    ------
    InputError
        If a speed is not known, or there are fewer than two.
    """
    require_conditions(spikes)
    units = spikes.units.index
    rates = pd.DataFrame(spikes.rates(), columns=units).where(lambda rate: rate > 0)
    trials = {"texture": spikes.trials["texture"], "speed": np.log(spikes.trials["speed_mm_s"])}
    fires = (
        rates.apply(np.log).assign(**trials).melt(["texture", "speed"], var_name="unit").dropna()
    )
    keys = [fires["unit"], fires["texture"]]
    centred = fires["speed"] - fires["speed"].groupby(keys).transform("mean")
    square = (centred**2).groupby(keys).sum()
    slopes = (centred * fires["value"]).groupby(keys).sum() / square.where(square > 1e-9)
    by_unit = slopes.groupby("unit").agg(slope="mean", spread="std", n_textures="count")
    found = spikes.units[["class"]].join(by_unit).fillna({"n_textures": 0})
    return found.astype({"n_textures": int}).reset_index()


def stretch_match(
    spikes: Spikes, n_units: int | None = 8, seconds: float = 2.0, seed: int = 0
) -> pd.DataFrame:
    """Return how often a train finds its own texture at another speed, stretched and as it is.

    For two speeds, the trains of each texture at the second are held against those of all textures
    at the first; the most alike is the match. Likeness is the correlation of smoothed trains,
    summed over the units of a class that both trials have, at the shift where it is greatest: where
    on the drum a recording began is not known. It is divided by the root of the number of these
    units, by which sums of noise grow, so that gaps in recordings give no texture away. The mean of
    repetitions is taken. Textures that no unit was recorded on at both speeds, and pairs of speeds
    with fewer than two textures in common, are left out.

    Parameters
    ----------
    n_units
        Of each class, drawn at random; None for all.
    seconds
        How long the trains are that are compared, at the second speed.

    Returns
    -------
    pandas.DataFrame
        `class`, `from_mm_s`, `to_mm_s`, `stretched` (bool), `accuracy`, `chance` (one in the number
        of textures), `n_textures`, `n_units` (recorded at both speeds) and `n_trains` (at both).

    Raises
    ------
    InputError
        If there are fewer than two textures or speeds, a speed is not known, or no unit fires.
    """
    speeds = require_conditions(spikes)
    texture = spikes.trials["texture"].to_numpy(str)
    speed = spikes.trials["speed_mm_s"].to_numpy(np.float64)
    rows = []
    for name in spikes.units["class"].unique():
        units = spikes.of_class(name)
        if n_units is not None:
            units = some_units(units, n_units, np.random.default_rng(seed))
        if not len(units.times):
            continue
        recorded = units.recorded
        for first, second in permutations(speeds, 2):
            there = [
                {t: recorded[(texture == t) & (speed == one)].any(axis=0) for t in set(texture)}
                for one in (first, second)
            ]
            both = [t for t in there[0] if (there[0][t] & there[1][t]).any()]
            if len(both) < 2:
                continue
            kept = np.isin(texture, both) & recorded.any(axis=1)
            moved, still = (units.select(trials=kept & (speed == one)) for one in (first, second))
            given = {"class": name, "from_mm_s": first, "to_mm_s": second}
            for stretched in (True, False):
                factor = first / second if stretched else 1.0
                found = _match(moved, still, factor, second, seconds)
                rows.append({**given, "stretched": stretched, **found})
    if not rows:
        raise InputError("spikes: expected units that fire, on 2 textures at 2 speeds, found none")
    return pd.DataFrame(rows)


def match_by_class(matches: pd.DataFrame) -> pd.DataFrame:
    """Return the means of `stretch_match` for each class, with 95% intervals over second speeds.

    Of textures, units and trains the most that a pair of speeds had.
    """
    rows = []
    for (name, stretched), some in matches.groupby(["class", "stretched"], sort=False):
        means = some.groupby("to_mm_s")["accuracy"].mean()
        by_speed = dict(zip(means.index, means, strict=True))
        n = {key: int(some[key].max()) for key in ("n_textures", "n_units", "n_trains")}
        found = {**mean_with_interval(by_speed), "chance": float(some["chance"].mean()), **n}
        rows.append({"class": name, "stretched": stretched, **found})
    return pd.DataFrame(rows)


def _match(
    moved: Spikes, still: Spikes, factor: float, to_mm_s: float, seconds: float
) -> dict[str, float]:
    """Return the share of textures that find themselves, and of how many.

    Likeness is the greatest correlation over shifts, summed over units.
    """
    n_units = int((moved.recorded.any(axis=0) & still.recorded.any(axis=0)).sum())
    n_trains = int(moved.recorded.sum() + still.recorded.sum())
    moved = moved.stretched(factor)
    ends_s = [one.trials["duration_s"].min() for one in (moved, still)]
    n = max(int(min(*ends_s, seconds) / RESOLUTION_S), 2)
    sigma = SMOOTHING_MM / to_mm_s / RESOLUTION_S  # of bins
    shared = moved.recorded.astype(np.float64) @ still.recorded.T
    first, second = _smoothed(moved, n, sigma), _smoothed(still, n, sigma).conj().transpose(2, 1, 0)
    summed = []
    for start in range(0, len(first), _AT_ONCE):
        some = first[start : start + _AT_ONCE].transpose(2, 0, 1)
        summed.append(np.fft.irfft(some @ second, axis=0).max(axis=0))
    likeness = pd.DataFrame(
        np.concatenate(summed) / np.sqrt(np.where(shared > 0, shared, np.nan)),
        moved.trials["texture"].to_numpy(str),
        still.trials["texture"].to_numpy(str),
    )
    by_texture = likeness.groupby(level=0).mean().T.groupby(level=0).mean().T
    right = by_texture.fillna(-np.inf).to_numpy().argmax(axis=0) == np.arange(len(by_texture))
    return {
        "accuracy": float(np.mean(right)),
        "chance": 1 / len(by_texture),
        "n_textures": len(by_texture),
        "n_units": n_units,
        "n_trains": n_trains,
    }


def _smoothed(spikes: Spikes, n: int, sigma: float) -> NDArray[np.complex128]:
    """Return (trial, unit, frequency): transforms of smoothed trains of mean 0 and variance 1."""
    counts = np.nan_to_num(spikes.binned(RESOLUTION_S, (n + 0.5) * RESOLUTION_S).values[..., :n])
    # no circle: the trains' ends are followed by as much silence
    frequency = np.fft.rfftfreq(2 * n)
    smooth = np.exp(-2 * (np.pi * frequency * sigma) ** 2)
    level = counts - counts.mean(axis=-1, keepdims=True)
    transformed = np.fft.rfft(level, 2 * n, axis=-1) * smooth
    size = np.sqrt((np.abs(transformed) ** 2).sum(axis=-1, keepdims=True))
    scaled: NDArray[np.complex128] = transformed / np.where(size > 0, size, np.inf)
    return scaled

"""Distances between spike trains, and textures found by the nearest train.

Victor & Purpura (Network 8:127, 1997) count what it costs to turn one train into another: 1 for a
spike more or less, and a cost for each second that a spike is moved. Van Rossum (Neural Comput.
13:751, 2001) smooths trains with an exponential and takes their difference. Both are elephant's.
The ISI and SPIKE distances (Kreuz et al., J. Neurosci. Methods 165:151, 2007; J. Neurophysiol.
109:1457, 2013) need no constant of time, and are PySpike's. All need the extra ``neural``.
"""

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes

Trains = Sequence[NDArray[np.float64]]
Distance = Callable[[Trains, float, float], Any]
"""Of trains of one length: takes their times, s, that length, s, and the scale of time, s."""


def victor_purpura(trains: Trains, duration_s: float, time_s: float) -> Any:
    """Return Victor & Purpura's (train, train): a spike moved by `time_s` costs 2."""
    elephant, times, pq = _elephant(trains, duration_s)
    return elephant.victor_purpura_distance(times, 2 / time_s * pq.Hz)


def van_rossum(trains: Trains, duration_s: float, time_s: float) -> Any:
    """Return van Rossum's (train, train), with `time_s` as the exponential's time constant."""
    elephant, times, pq = _elephant(trains, duration_s)
    return elephant.van_rossum_distance(times, time_constant=time_s * pq.s)


def _pyspike(name: str, trains: Trains, duration_s: float, time_s: float) -> Any:
    """Return a distance (train, train) of PySpike, 0 to 1; `time_s` is left."""
    pyspike: Any = import_extra("neural", "spike distances", "pyspike")
    with warnings.catch_warnings(action="ignore"):
        times = [pyspike.SpikeTrain(np.asarray(one), (0.0, duration_s)) for one in trains]
    return getattr(pyspike, name)(times)


DISTANCES: dict[str, Distance] = {
    "victor-purpura": victor_purpura,
    "van-rossum": van_rossum,
    "isi": partial(_pyspike, "isi_distance_matrix"),
    "spike": partial(_pyspike, "spike_distance_matrix"),
}
"""By name; of ISI how unlike the intervals around moments are, of SPIKE how far spikes are from the
other's."""
_SCALED = ("victor-purpura", "van-rossum")
"""Those that take the scale of time."""


def distance_matrix(
    spikes: Spikes, unit: int, distance: str = "victor-purpura", time_s: float = 0.01
) -> NDArray[np.float64]:
    """Return (trial, trial): how far one unit's trains are from each other.

    Parameters
    ----------
    unit
        Its place.
    distance
        One of `DISTANCES`.
    time_s
        Scale of time: a spike moved by so much costs as much as one more and one less, or is
        smoothed by so much; more than 0 s. ISI and SPIKE have no scale and leave it.

    Raises
    ------
    InputError
        If there is no such distance, its scale is not above 0, trials differ in length, the unit
        was not recorded in one, or the extra ``neural`` is missing.
    """
    if distance not in DISTANCES:
        raise InputError(f"distance: expected one of {', '.join(DISTANCES)}, found '{distance}'")
    if distance in _SCALED and not time_s > 0:
        raise InputError(f"time_s: expected more than 0 s for {distance}, found {time_s:g}")
    lengths = spikes.trials["duration_s"]
    if float(np.ptp(lengths)) > 1e-6:
        found = f"{lengths.min():g} to {lengths.max():g} s"
        raise InputError(
            f"spikes: expected trials of one length, found {found}; cut windows of them"
        )
    if not spikes.recorded[:, unit].all():
        name = spikes.units.index[unit]
        raise InputError(f"spikes: expected unit {name} in every trial, found trials without it")
    trains = [spikes.train(trial, unit) for trial in range(spikes.n_trials)]
    return np.asarray(DISTANCES[distance](trains, float(lengths.iloc[0]), time_s))


def found_by_nearest(distances: NDArray[np.float64], textures: Sequence[str]) -> float:
    """Return the share of trials whose nearest other trial is of their own texture.

    Parameters
    ----------
    distances
        (trial, trial); of several units their sum.
    textures
        Of the trials.
    """
    apart = np.array(distances, np.float64)
    np.fill_diagonal(apart, np.inf)
    names = np.asarray(textures)
    return float(np.mean(names[apart.argmin(axis=1)] == names))


def _elephant(trains: Trains, duration_s: float) -> tuple[Any, list[Any], Any]:
    """Return elephant's distances, trains as it takes them, and the units of `quantities`."""
    elephant = import_extra("neural", "spike distances", "elephant.spike_train_dissimilarity")
    import neo
    import quantities as pq

    times = [neo.SpikeTrain(np.asarray(one) * pq.s, t_stop=duration_s * pq.s) for one in trains]
    return elephant, times, pq

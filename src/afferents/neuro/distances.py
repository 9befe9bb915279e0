"""Distances between spike trains, and textures found by the nearest train.

Victor & Purpura (Network 8:127, 1997) count what it costs to turn one train into another: 1 for a
spike more or less, and a cost for each second that a spike is moved. Van Rossum (Neural Comput.
13:751, 2001) smooths trains with an exponential and takes their difference. Both are elephant's.
The ISI and SPIKE distances (Kreuz et al., J. Neurosci. Methods 165:151, 2007; J. Neurophysiol.
109:1457, 2013) need no constant of time, and are PySpike's. All need the extra ``neural``.
"""

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes

DISTANCES = ("victor-purpura", "van-rossum", "isi", "spike")
"""ISI: how unlike the intervals around moments are. SPIKE: how far spikes are from the other's."""
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
        Scale of time, more than 0 s: a spike that is moved by it costs as much as one more and one
        less (Victor & Purpura), or is smoothed by it (van Rossum). ISI and SPIKE have no scale.

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
    duration_s, what = float(lengths.iloc[0]), "spike distances"
    if distance not in _SCALED:
        pyspike: Any = import_extra("neural", what, "pyspike")
        with warnings.catch_warnings(action="ignore"):
            times = [pyspike.SpikeTrain(train, (0.0, duration_s)) for train in trains]
        return np.asarray(getattr(pyspike, f"{distance}_distance_matrix")(times))
    elephant = import_extra("neural", what, "elephant.spike_train_dissimilarity")
    import neo
    from quantities import Hz, s

    times = [neo.SpikeTrain(train * s, t_stop=duration_s * s) for train in trains]
    if distance == "victor-purpura":  # a spike moved by `time_s` costs 2
        return np.asarray(elephant.victor_purpura_distance(times, 2 / time_s * Hz))
    return np.asarray(elephant.van_rossum_distance(times, time_constant=time_s * s))


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

"""Distances between spike trains, and textures found by the nearest train.

Victor & Purpura (Network 8:127, 1997) count what it costs to turn one train into another: 1 for a
spike more or less, and a cost for each second that a spike is moved. Van Rossum (Neural Comput.
13:751, 2001) smooths trains with an exponential and takes their difference. Both are elephant's.
The ISI and SPIKE distances (Kreuz et al., J. Neurosci. Methods 165:151, 2007; J. Neurophysiol.
109:1457, 2013) need no constant of time, and are PySpike's. All need the extra ``neural``.
"""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes

Trains = Sequence[NDArray[np.float64]]


class Distance(ABC):
    """A distance between trains of one length.

    Attributes
    ----------
    name
        In calls and tables.
    """

    name: ClassVar[str]

    @abstractmethod
    def matrix(self, trains: Trains, duration_s: float, time_s: float) -> NDArray[np.float64]:
        """Return (train, train).

        Parameters
        ----------
        trains
            Times of spikes, s, ascending.
        duration_s
            How long they all are.
        time_s
            Scale of time: a spike moved by so much costs as much as one more and one less, or is
            smoothed by so much. Distances without a scale leave it.
        """


class VictorPurpura(Distance):
    """Victor & Purpura's, with a cost of ``2 / time_s`` for each second that a spike is moved."""

    name: ClassVar[str] = "victor-purpura"

    def matrix(self, trains: Trains, duration_s: float, time_s: float) -> NDArray[np.float64]:
        """Return (train, train), in spikes added or taken away."""
        import_extra("neural", "spike distances", "elephant.spike_train_dissimilarity")
        import quantities as pq
        from elephant.spike_train_dissimilarity import victor_purpura_distance

        q = (np.inf if time_s == 0 else 2 / time_s) * pq.Hz
        found: NDArray[np.float64] = victor_purpura_distance(_neo(trains, duration_s), q)
        return found


class VanRossum(Distance):
    """Van Rossum's, with ``time_s`` as the time constant of the exponential."""

    name: ClassVar[str] = "van-rossum"

    def matrix(self, trains: Trains, duration_s: float, time_s: float) -> NDArray[np.float64]:
        """Return (train, train)."""
        import_extra("neural", "spike distances", "elephant.spike_train_dissimilarity")
        import quantities as pq
        from elephant.spike_train_dissimilarity import van_rossum_distance

        found: NDArray[np.float64] = van_rossum_distance(
            _neo(trains, duration_s), time_constant=time_s * pq.s
        )
        return found


class Isi(Distance):
    """The ISI distance: how unlike the intervals around each moment are, 0 to 1."""

    name: ClassVar[str] = "isi"

    def matrix(self, trains: Trains, duration_s: float, time_s: float) -> NDArray[np.float64]:
        """Return (train, train)."""
        spike = import_extra("neural", "spike distances", "pyspike")
        found: NDArray[np.float64] = spike.isi_distance_matrix(_pyspike(trains, duration_s))
        return found


class SpikeDistance(Distance):
    """The SPIKE distance: how far spikes are from those of the other around each moment, 0 to 1."""

    name: ClassVar[str] = "spike"

    def matrix(self, trains: Trains, duration_s: float, time_s: float) -> NDArray[np.float64]:
        """Return (train, train)."""
        spike = import_extra("neural", "spike distances", "pyspike")
        found: NDArray[np.float64] = spike.spike_distance_matrix(_pyspike(trains, duration_s))
        return found


DISTANCES: dict[str, Distance] = {
    one.name: one for one in (VictorPurpura(), VanRossum(), Isi(), SpikeDistance())
}
"""By name."""


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
        Scale of time; see `Distance.matrix`.

    Raises
    ------
    InputError
        If there is no such distance, trials differ in length, the unit was not recorded in one, or
        the extra ``neural`` is missing.
    """
    if distance not in DISTANCES:
        raise InputError(f"distance: expected one of {', '.join(DISTANCES)}, found '{distance}'")
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
    return DISTANCES[distance].matrix(trains, float(lengths.iloc[0]), time_s)


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


def _neo(trains: Trains, duration_s: float) -> list[object]:
    import neo
    import quantities as pq

    return [neo.SpikeTrain(np.asarray(one) * pq.s, t_stop=duration_s * pq.s) for one in trains]


def _pyspike(trains: Trains, duration_s: float) -> list[object]:
    import pyspike

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [pyspike.SpikeTrain(np.asarray(one), (0.0, duration_s)) for one in trains]

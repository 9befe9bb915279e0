"""Leave one speed out, as a scikit-learn splitter, under either protocol."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.fold import Fold, Indices
from afferents.core.protocol import PROTOCOLS, Protocol
from afferents.core.samples import Samples


@dataclass
class LeaveOneSpeedOut:
    """Hold out one speed at a time; what validates the training depends on the protocol.

    A random split would put neighbouring frames (11 ms apart) and overlapping windows on both
    sides and report memory as recognition; holding whole speeds out prevents that bias.

    ==============  ====================================  ======================================
    protocol        nested                                published
    ==============  ====================================  ======================================
    training        other speeds but the validation's     all other speeds
    validation      one whole training speed              half of the held-out speed
    test            all of the held-out speed             the other half of it
    ==============  ====================================  ======================================

    The published halves are every second frame or window of a recording, even ones validating
    (process_static.ipynb, cell 5); with `random_halves`, as for spectra, window numbers drawn
    at random for each fold, the same for all textures (process_vibration.ipynb, cell 7). Where
    recordings have a single window each, every second recording of a texture takes its place.

    >>> speeds = [10, 10, 20, 20, 30, 30]
    >>> for train, test in LeaveOneSpeedOut().split(speeds, groups=speeds):
    ...     print(train, test)
    [4 5] [0 1]
    [0 1] [2 3]
    [0 1] [4 5]
    """

    protocol: Protocol = field(default_factory=lambda: PROTOCOLS["nested"])
    random_halves: bool = False
    seed: int = 0

    def get_n_splits(self, X: Any = None, y: Any = None, groups: ArrayLike | None = None) -> int:  # noqa: N803
        """Return the number of speeds."""
        return len(np.unique(_required(groups)))

    def split(
        self,
        X: Any,  # noqa: N803
        y: Any = None,
        groups: ArrayLike | None = None,
    ) -> Iterator[tuple[Indices, Indices]]:
        """Yield (train, test) for each speed, ascending; `groups` are the speeds, mm/s.

        Samples are taken to stand in the order of time, one recording a speed; use `folds`
        where there are several.
        """
        speeds = np.asarray(_required(groups), dtype=float)
        names = np.array([f"{v:g}" for v in speeds])
        for fold in self._folds(speeds, names, names):
            yield fold.train, fold.test

    def folds(self, samples: Samples) -> Iterator[Fold]:
        """Yield the folds of `samples`, held-out speeds ascending.

        Raises
        ------
        InputError
            If there are too few speeds (3 for `nested`, 2 for `published`), or none left to
            train on.
        """
        yield from self._folds(*_labels(samples))

    def fold(self, samples: Samples, held_out_mm_s: float) -> tuple[int, Fold]:
        """Return one of the folds, without the others, and its rank among them.

        Raises
        ------
        InputError
            As `folds`.
        """
        speeds, recordings, textures = _labels(samples)
        ranked = self._ranked(speeds)
        rank = ranked.index(held_out_mm_s)
        return rank, self._fold(rank, ranked, speeds, recordings, textures)

    def _folds(
        self, speeds: NDArray[np.float64], recordings: NDArray[Any], textures: NDArray[Any]
    ) -> Iterator[Fold]:
        ranked = self._ranked(speeds)
        for rank in range(len(ranked)):
            yield self._fold(rank, ranked, speeds, recordings, textures)

    def _ranked(self, speeds: NDArray[np.float64]) -> tuple[float, ...]:
        ranked = tuple(float(v) for v in np.unique(speeds))
        if len(ranked) < 2:
            raise InputError("the data", "at least 2 speeds to hold one out", f"{len(ranked)}")
        return ranked

    def _fold(
        self,
        rank: int,
        ranked: tuple[float, ...],
        speeds: NDArray[np.float64],
        recordings: NDArray[Any],
        textures: NDArray[Any],
    ) -> Fold:
        held_out = ranked[rank]
        validation_speed = self.protocol.validation_speed(ranked, held_out)
        held = speeds == held_out
        if validation_speed == held_out:
            validating = self._validating_half(recordings, textures, held, rank)
            validation, test, train = held & validating, held & ~validating, ~held
        else:
            validation, test = speeds == validation_speed, held
            train = ~held & ~validation
        parts = (np.flatnonzero(part) for part in (train, validation, test))
        return Fold(held_out, validation_speed, *parts)

    def _validating_half(
        self, recordings: NDArray[Any], textures: NDArray[Any], held: NDArray[np.bool_], rank: int
    ) -> NDArray[np.bool_]:
        number = number_in_recording(recordings)
        if not number[held].any():
            number[held] = number_in_recording(textures[held])
        if not self.random_halves:
            return np.equal(number % 2, 0)
        n = int(number[held].max()) + 1
        drawn = np.random.default_rng([self.seed, rank]).permutation(n)[: n // 2]
        return np.isin(number, drawn)


def number_in_recording(recordings: NDArray[Any]) -> Indices:
    """Return each sample's running number within its recording, from 0, in order of time."""
    order = np.argsort(recordings, kind="stable")
    _, first, count = np.unique(recordings[order], return_index=True, return_counts=True)
    number = np.empty(len(recordings), dtype=np.int64)
    number[order] = np.arange(len(recordings)) - np.repeat(first, count)
    return number


def _labels(samples: Samples) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return the speed, recording and texture of every sample."""
    return (
        samples[dims.SPEED].values,
        samples[dims.RECORDING].values,
        samples[dims.TEXTURE].values,
    )


def _required(groups: ArrayLike | None) -> ArrayLike:
    if groups is None:
        raise InputError("groups", "the speed of every sample, mm/s", "none")
    return groups

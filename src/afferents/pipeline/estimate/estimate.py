"""How long tracking and all trainings take, from what was measured of each."""

import heapq
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from afferents.core.model import Model


@dataclass(frozen=True)
class Work:
    """The trainings of one model under one protocol.

    Attributes
    ----------
    group
        Models of one group are trained side by side; the groups one after the other.
    fold_s
        How long one fold takes in one process, s.
    n_folds
        That are to be trained, of all seeds.
    epochs, n_train, learn_hz
        Epochs of a fold (expected, where training stops early; None of what has none, or is
        measured whole), samples of each, and how many are learnt from in a second.
    encode_s
        How long its samples take to be made, s.
    """

    model: Model
    protocol: str
    group: int
    fold_s: float
    n_folds: int
    epochs: float | None
    n_train: float
    learn_hz: float
    encode_s: float


@dataclass(frozen=True)
class Estimate:
    """What a reproduction costs: work in one process, and how it is spread over several.

    Attributes
    ----------
    frames, frame_s, recordings
        To be tracked: frames, what one takes in one process (s), and in how many recordings.
    gpu
        Whether trainings were measured on a GPU, which several processes share.
    processes, cluster
        How many will be at work, and whether they are a cluster's.
    """

    frames: float
    frame_s: float
    recordings: int
    works: tuple[Work, ...] = ()
    gpu: bool = False
    processes: int = 1
    cluster: bool = False

    @property
    def total_s(self) -> float:
        """Return how long all takes where it will be done, s."""
        where = self.cluster_s if self.cluster else self.here_s
        return where(self.processes)

    def describe(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "total_s": self.total_s,
            "processes": self.processes,
            "cluster": self.cluster,
            "tracking_s": self.tracking_s(self.processes),
            "frames": self.frames,
            "trainings": [
                {
                    "model": work.model.name,
                    "protocol": work.protocol,
                    "folds": work.n_folds,
                    "fold_s": work.fold_s,
                    "epochs": work.epochs,
                    "samples": work.n_train,
                }
                for work in self.works
            ],
        }

    @property
    def n_folds(self) -> int:
        """Return how many trainings there are."""
        return sum(work.n_folds for work in self.works)

    def tracking_s(self, processes: int) -> float:
        """Return how long tracking takes in so many processes, s; each takes whole recordings."""
        if not self.recordings:
            return 0.0
        each = self.frames * self.frame_s / self.recordings
        return makespan([each] * self.recordings, processes)

    def training_s(self, processes: int) -> float:
        """Return how long the trainings take in so many processes, s, as `evaluate` orders them."""
        at_once = 1 if self.gpu else processes
        total = 0.0
        for _, of_group in groupby(self.works, key=lambda work: work.group):
            works = list(of_group)
            total += works[0].encode_s + makespan(_folds(works), at_once)
        return total

    def here_s(self, processes: int) -> float:
        """Return how long all takes in so many processes like this machine's, s."""
        return self.tracking_s(processes) + self.training_s(processes)

    def cluster_s(self, processes: int) -> float:
        """Return how long all takes on a cluster, s: no training waits for those of other models.

        Each worker reads and encodes what it needs.
        """
        encoding = sum(next(g).encode_s for _, g in groupby(self.works, key=lambda w: w.group))
        return self.tracking_s(processes) + encoding + makespan(_folds(self.works), processes)


def _folds(works: Iterable[Work]) -> list[float]:
    return [work.fold_s for work in works for _ in range(work.n_folds)]


def makespan(seconds: Sequence[float], processes: int) -> float:
    """Return how long jobs take, s, if each process takes the next as soon as it is free."""
    free = [0.0] * max(1, processes)
    for one in seconds:
        heapq.heapreplace(free, free[0] + one)
    return max(free)

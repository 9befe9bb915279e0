"""How long a reproduction will take, from what was measured of each step, in sentences."""

import heapq
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
import xarray as xr

from afferents import dims
from afferents.choices import Cut
from afferents.errors import AfferentsError, InputError
from afferents.folds.ablation import Ablation
from afferents.folds.held_out import Group, Split
from afferents.models.model import Model
from afferents.quality.lasting import EDGE_S
from afferents.recordings.check import Facts, facts
from afferents.recordings.session import Session
from afferents.reporting.published import published_costs
from afferents.store.recording import Recording
from afferents.store.responses import label
from afferents.store.trimming import AUDIO_S, Steady, cut_audio, cut_frames


@dataclass(frozen=True)
class Amount:
    """What is to be gone through, by the headers of the files alone.

    Attributes
    ----------
    used
        Recordings that are evaluated, counted as so many of the length of the one measured.
    groups
        To be held out in turn; `n_groups` are there.
    """

    used: float
    groups: tuple[Group, ...]
    n_groups: int


def amount_of(
    session: Session,
    sample: Recording,
    cut: Cut,
    split: Split,
    held_out: Sequence[Group],
    ablation: Ablation,
    steady: Steady | None,
) -> Amount:
    """Return how much a session is.

    Parameters
    ----------
    sample
        The recording that is measured; others count by their length beside its.

    Raises
    ------
    InputError
        If a group or texture asked for is not there.
    """
    named = [label(xr.Dataset(), recording) for recording in session.recordings]
    evaluated = ablation.recordings(named)
    names = {str(one.attrs["name"]) for one in evaluated}
    there = split.groups_of(evaluated)
    split.require(held_out, there, "--held-out")
    seconds = {r.name: used_s(r, cut, steady) for r in session.recordings if r.name in names}
    return Amount(
        sum(seconds.values()) / used_s(sample, cut, steady),
        tuple(held_out) or tuple(there),
        len(there),
    )


def n_frames(recording: Recording) -> int:
    """Return how many frames a recording's video declares; 0 if it can't be read."""
    found = _facts(recording)
    return found.video.n_frames if found and found.video else 0


def used_s(recording: Recording, cut: Cut, steady: Steady | None = None) -> float:
    """Return about how much of a recording the cut leaves, s; 0 if it can't be read."""
    found = _facts(recording)
    if found is None:
        return 0.0
    if cut == "published":
        return AUDIO_S
    start_stop = steady or recording.steady_s
    if start_stop is not None:
        return max(1e-3, start_stop[1] - start_stop[0])
    lengths = [f.duration_s for f in (found.video, found.vibration) if f is not None]
    return max(1e-3, min(lengths) - 2 * EDGE_S)


def _facts(recording: Recording) -> Facts | None:
    """Return what a recording's headers say; None where that is refused when it is extracted."""
    try:
        return facts(recording)
    except AfferentsError:
        return None


def require_length(session: Session, cut: Cut) -> None:
    """Refuse recordings that are too short for the cut, before any is tracked.

    Raises
    ------
    InputError
        Naming the first.
    """
    for recording in session.recordings if cut == "published" else ():
        _require_fits(facts(recording), cut)


def typical(
    recordings: Sequence[Recording], cut: Cut, steady: Steady | None = None
) -> list[Recording]:
    """Return recordings that the cut leaves something of, those of usual length first."""
    fitting = [recording for recording in recordings if _fits(recording, cut)]
    seconds = {recording.name: used_s(recording, cut, steady) for recording in fitting}
    usual = float(np.median(list(seconds.values()))) if fitting else 0.0
    return sorted(fitting, key=lambda recording: abs(seconds[recording.name] - usual))


def _fits(recording: Recording, cut: Cut) -> bool:
    found = _facts(recording)
    if found is None:
        return False
    try:
        if cut == "published":
            _require_fits(found, cut)
    except InputError:
        return False
    return True


def _require_fits(found: Facts, cut: Cut) -> None:
    if found.video is not None:
        cut_frames(np.zeros(found.video.n_frames), cut, None, found.name)
    if found.vibration is not None:
        n, rate_hz = found.vibration.n_samples, found.vibration.sample_rate_hz
        cut_audio(n, rate_hz, cut, None, found.name)


def lengthened(responses: xr.Dataset, recording: Recording) -> xr.Dataset:
    """Return the responses to a clip of a recording, repeated to the recording's own length."""
    if dims.TIME not in responses.dims:
        return responses
    n, rate_hz = n_frames(recording), recording.fps_hz or 1.0
    seen = np.flatnonzero(responses[dims.DETECTED].values.any(axis=1))
    repeated = responses.isel({dims.TIME: seen[np.arange(n) % len(seen)]})
    return repeated.assign_coords({dims.TIME: np.arange(n) / rate_hz})


# How long tracking and all trainings take, from what was measured of each.


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


# An estimate in sentences.

CORES, NODES = 16, 20
"""Beside this machine's own number of processes, what it would be on so many is said."""


def in_words(estimate: Estimate) -> list[str]:
    """Return what an estimate says."""
    n, total = estimate.processes, duration(estimate.total_s)
    if not estimate.recordings and not estimate.works:
        return ["Nothing is left to be tracked or trained."]
    where = f"on the cluster's {n} processes" if estimate.cluster else f"here, {_many(n)}"
    return [
        f"About {total} {where}: an estimate, from rates measured on a few frames and "
        "batches in one process that had the machine to itself, times what there is.",
        *_tracking(estimate),
        *(_training(work) for work in estimate.works),
        *_elsewhere(estimate),
        *_doubts(estimate),
    ]


def _many(processes: int) -> str:
    return f"in {processes} process{'es' if processes > 1 else ''} (--workers)"


def _tracking(estimate: Estimate) -> Iterator[str]:
    if estimate.recordings and estimate.frame_s:
        yield (
            f"  tracking {estimate.frames:,.0f} frames of {estimate.recordings} recordings, "
            f"{1 / estimate.frame_s:,.0f} a second in a process: "
            f"{duration(estimate.tracking_s(estimate.processes))}"
        )


def _training(work: Work) -> str:
    samples = f"{work.n_train:,.0f} samples"
    if work.epochs is not None:
        rate = "" if math.isinf(work.learn_hz) else f" at {work.learn_hz:,.0f} a second"
        samples = f"{work.epochs:.0f} epochs of {samples}{rate}"
    folds = "1 fold" if work.n_folds == 1 else f"each of {work.n_folds} folds"
    return f"  {work.model.title}, {work.protocol}: {folds} {duration(work.fold_s)} ({samples})"


def _elsewhere(estimate: Estimate) -> Iterator[str]:
    if estimate.gpu:
        yield "  Trainings were measured on the GPU, and taken one after the other on it."
        return
    others = [n for n in (CORES,) if n != estimate.processes]
    more = [f"{duration(estimate.here_s(n))} with {n} such cores" for n in others]
    more.append(f"{duration(estimate.cluster_s(NODES))} on a cluster of {NODES} such processes")
    yield f"  The same work: {', '.join(more)}."
    if (seconds := authors_gpu_s(estimate)) is not None:
        yield (
            f"  On one GPU such as the authors' (they name none; by the seconds in their logs) the "
            f"trainings: {duration(seconds)}. Tracking gains nothing by a GPU. No GPU was measured."
        )


def authors_gpu_s(estimate: Estimate) -> float | None:
    """Return how long the trainings would take on the authors' GPU, s, by their logs.

    None if there are others than the paper's networks, trained as they were.
    """
    costs = published_costs()
    total = 0.0
    for work in estimate.works:
        if work.model.name not in costs or work.epochs is None:
            return None
        total += work.n_folds * work.epochs * work.n_train * costs[work.model.name].sample_s
    return total or None


def _doubts(estimate: Estimate) -> Iterator[str]:
    if any(_stops_early(work) for work in estimate.works):
        yield (
            "  Where training stops early, as many epochs are taken as the authors' logs have in "
            "the mean; yours may need fewer or more."
        )
    yield "  Not in it: checking and writing files, the report, and whatever else runs here."


def _stops_early(work: Work) -> bool:
    return work.epochs is not None and work.epochs != round(work.epochs)


def duration(seconds: float) -> str:
    """Return a time in words: ``0.4 s``, ``40 s``, ``12 min``, ``3 h 20 min``, ``2 days 4 h``."""
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 9.5 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"{minutes} min"
    hours, rest = divmod(minutes, 60)
    if hours < 48:
        return f"{hours} h {rest:02d} min"
    days, hours = divmod(round(minutes / 60), 24)
    return f"{days} days {hours} h"

"""An estimate in sentences."""

import math
from collections.abc import Iterator

from afferents.pipeline.estimate.estimate import Estimate, Work
from afferents.reporting.published import published_costs

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
        "batches in one process as if nothing else ran, times what there is.",
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

"""How long the same trainings take in one process, in one a core, and on a Dask cluster.

    python benchmarks/engine_speed.py [--jobs 8] [--repeats 3]

Each job trains `SpatialNet` on random images in one thread, as a fold of `evaluate` does. The
cluster is a `LocalCluster` of as many processes as there are cores, spoken to over TCP, and there
only while it is measured; like the processes of this machine it is warm: it has done a job each
before the clock starts. The ways take turns. Prints a table in Markdown.
"""

import argparse
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path

from distributed import LocalCluster
from joblib import cpu_count
from training_speed import CASES, loop_rate, machine

from afferents.outputs import writing_alone
from afferents.parallel import on_cluster, side_by_side

Job = tuple[object, ...]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    jobs: list[Job] = [(CASES[0], "float32")] * arguments.jobs
    cores = cpu_count()
    ways: dict[str, Callable[[list[Job]], float]] = {
        "one process": lambda some: seconds_of(side_by_side(loop_rate, some, 1)),
        f"{cores} processes": lambda some: warm_seconds(
            lambda them: side_by_side(loop_rate, them, cores), some, cores
        ),
        f"Dask, {cores} processes": lambda some: dask_seconds(some, cores),
    }
    seconds: dict[str, list[float]] = defaultdict(list)
    for _ in range(arguments.repeats):
        for name, way in ways.items():
            seconds[name].append(way(jobs))
    print(f"{machine()}\n\n{arguments.jobs} jobs, median of {arguments.repeats}.\n")
    print("| way | seconds | times one process |\n|---|---|---|")
    alone = statistics.median(seconds["one process"])
    for name, found in seconds.items():
        median = statistics.median(found)
        print(f"| {name} | {median:.1f} | {alone / median:.2f} |")


def seconds_of(results: Iterable[float]) -> float:
    """Return how long the results take to come."""
    start = time.perf_counter()
    list(results)
    return time.perf_counter() - start


def warm_seconds(way: Callable[[list[Job]], Iterable[float]], jobs: list[Job], cores: int) -> float:
    """Return how long jobs take in processes that have each done one."""
    list(way(jobs[:cores]))
    return seconds_of(way(jobs))


def dask_seconds(jobs: list[Job], cores: int) -> float:
    """Return how long jobs take on a cluster that is there for them alone: idle, it disturbs."""
    with LocalCluster(
        n_workers=cores, threads_per_worker=1, processes=True, protocol="tcp",
        dashboard_address=":0",
    ) as cluster, tempfile.TemporaryDirectory() as folder:  # fmt: skip
        there = cluster.scheduler_address, Path(folder)
        with writing_alone(Path(folder), "benchmark"):
            return warm_seconds(lambda some: on_cluster(loop_rate, some, *there), jobs, cores)


if __name__ == "__main__":
    main()

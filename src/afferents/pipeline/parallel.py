"""Jobs side by side: processes of one thread each, on the cores of this machine."""

import os
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import joblib
from joblib.externals.loky import process_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from afferents.core.errors import AfferentsError

Result = TypeVar("Result")

_KEEP_MEMORY = {
    "MALLOC_MMAP_THRESHOLD_": str(8 << 30),
    "MALLOC_TRIM_THRESHOLD_": str(16 << 30),
    "MALLOC_TOP_PAD_": str(256 << 20),
}
"""For glibc, which gives freed memory back at once, while training asks for as much again at
every step. Read when a process starts."""


def side_by_side(
    function: Callable[..., Result], jobs: Iterable[tuple[Any, ...]], workers: int | None
) -> Iterator[Result]:
    """Call `function(*job)` for every job and yield the results as they come.

    Every process has one thread: several of them are faster than one with several, above all
    on a busy machine, and nothing depends on how many there are. Jobs are handed out one by
    one, in their order.

    Parameters
    ----------
    workers
        Processes; None for one a core. With 1 the jobs run in this process.

    Raises
    ------
    AfferentsError
        If a process died. Errors of `function` pass through, and stop the jobs that wait.
    """
    options: dict[str, Any] = {
        "return_as": "generator_unordered",
        "batch_size": 1,
        "pre_dispatch": "n_jobs",
    }
    options["mmap_mode"] = "c"  # as if it were the process's own, which PyTorch asks for
    options |= {"initializer": _prepare, "initargs": (os.getpid(),)}
    with _environment(_KEEP_MEMORY), joblib.parallel_config("loky", inner_max_num_threads=1):
        pool = joblib.Parallel(n_jobs=workers or joblib.cpu_count(), **options)
        results = pool(joblib.delayed(function)(*job) for job in jobs)
        try:
            for result in results:  # noqa: UP028 (closed below, without joblib's warning)
                yield result
        except TerminatedWorkerError as error:
            raise AfferentsError(
                "a worker process died (killed, or out of memory); what is finished is kept: run "
                "the same command again, with fewer --workers if memory was short"
            ) from error
        finally:
            with warnings.catch_warnings(action="ignore"):
                results.close()


def _prepare(caller: int) -> None:
    """Let a new process keep its memory, and end soon after the one that called.

    Where psutil is installed, loky takes a process that has grown by 300 MB for a leak, and
    starts another; ours hold on to what they freed, and map samples, on purpose. And who is killed
    can't tell its workers to stop.
    """
    process_executor._MAX_MEMORY_LEAK_SIZE = 1 << 62

    def watch() -> None:
        while os.getppid() == caller:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Set variables for the processes started inside, but not those that the user set."""
    added = {name: value for name, value in variables.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)

"""Jobs side by side: processes of one thread each, on the cores of this machine."""

import ctypes
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

import joblib
from joblib.externals.loky import process_executor
from joblib.externals.loky.process_executor import TerminatedWorkerError

from afferents.core.errors import AfferentsError

Result = TypeVar("Result")

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3
"""Options of glibc's mallopt(3)."""


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
        "mmap_mode": "c",  # as if it were the process's own, which PyTorch asks for
        "initializer": _prepare,
        "initargs": (os.getpid(),),
    }
    with joblib.parallel_config("loky", inner_max_num_threads=1):
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
    keep_freed_memory()

    def watch() -> None:
        while os.getppid() == caller:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def keep_freed_memory() -> None:
    """Let this process hold on to memory that it frees, where the C library is glibc.

    Training asks for as much again at every step. glibc would give it back each time, and on a
    Dask worker, which is told to, that doubles the time of a step.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt:
        mallopt(_TRIM_THRESHOLD, 2**31 - 1)
        mallopt(_TOP_PAD, 2**28)
        mallopt(_MMAP_THRESHOLD, 2**30)

"""Jobs side by side: processes of one thread each, on the cores of this machine."""

import ctypes
import os
import select
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager, nullcontext, suppress
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, TypeVar

import joblib
from joblib.externals.loky import process_executor
from joblib.externals.loky.backend import resource_tracker as loky_resource_tracker
from joblib.externals.loky.process_executor import TerminatedWorkerError

from afferents.core.errors import AfferentsError
from afferents.core.stopping import stop_later

Result = TypeVar("Result")
Job = tuple[Any, ...]

DEATHS = 3
"""So often a process may die with nothing come back in between; then all is given up."""

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3
"""Options of glibc's mallopt(3)."""


def side_by_side(
    function: Callable[..., Result],
    jobs: Iterable[Job],
    workers: int | None,
    note: Callable[[str], None] | None = None,
) -> Iterator[Result]:
    """Call `function(*job)` for every job and yield the results as they come.

    Every process has one thread: several of them are faster than one with several, above all
    on a busy machine, and nothing depends on how many there are. Jobs are handed out one by
    one, in their order. Where a process dies, the jobs that were being done begin anew, in new
    processes; so a job may be done twice.

    Parameters
    ----------
    workers
        Processes; None for one a core. With 1 the jobs run in this process.
    note
        Told when a process has died.

    Raises
    ------
    AfferentsError
        If processes die again and again. Errors of `function` pass through, and stop the jobs
        that wait.
    """
    waiting, deaths = dict(enumerate(jobs)), 0
    while waiting:
        before = len(waiting)
        try:
            with closing(_results(function, list(waiting.items()), workers)) as results:
                for number, result in results:
                    del waiting[number]
                    yield result
        except TerminatedWorkerError as error:
            deaths = deaths + 1 if len(waiting) == before else 1
            if deaths == DEATHS:
                raise AfferentsError(
                    "a worker process died, and again when its job was begun anew (killed, or out "
                    "of memory); what is finished is kept: run the same command again, with fewer "
                    "--workers if memory was short"
                ) from error
            if note:
                note("a worker process died (killed, or out of memory): what it did begins anew")


def _results(
    function: Callable[..., Result], jobs: Iterable[tuple[int, Job]], workers: int | None
) -> Generator[tuple[int, Result], None, None]:
    """Do numbered jobs, as long as no process dies."""
    options: dict[str, Any] = {
        "return_as": "generator_unordered",
        "batch_size": 1,
        "pre_dispatch": "n_jobs",
        "mmap_mode": "c",  # as if it were the process's own, which PyTorch asks for
        "initializer": _prepare,
        "initargs": (os.getpid(),),
    }
    n = workers or joblib.cpu_count()
    with joblib.parallel_config("loky", inner_max_num_threads=1):
        pool = joblib.Parallel(n_jobs=n, **options)
        here = Path.cwd()
        calls = (joblib.delayed(_numbered)(here, number, function, *job) for number, job in jobs)
        with stop_later(), _deaf_to_the_terminal() if n > 1 else nullcontext():
            results = pool(calls)
        try:
            for result in results:  # noqa: UP028 (closed below, without joblib's warning)
                yield result
        finally:
            with warnings.catch_warnings(action="ignore"):
                results.close()


@contextmanager
def _deaf_to_the_terminal() -> Iterator[None]:
    """Start processes inside that a Ctrl-C or a closed terminal, meant for all, does not reach.

    It is for this process to stop them, and they would print what they were at.
    """
    meant_for_all = {signal.SIGINT, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, meant_for_all)
    try:
        for tracker in (resource_tracker, loky_resource_tracker):
            tracker.ensure_running()  # which lets signals through again when it starts its own
        signal.pthread_sigmask(signal.SIG_BLOCK, meant_for_all)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _numbered(
    folder: Path, number: int, function: Callable[..., Result], *job: Any
) -> tuple[int, Result]:
    """Do a job in the caller's folder, which may have changed since a process was started."""
    if Path.cwd() != folder:
        os.chdir(folder)
    return number, function(*job)


def _prepare(caller: int) -> None:
    """Let a new process keep its memory, and end soon after the one that called.

    Where psutil is installed, loky takes a process that has grown by 300 MB for a leak, and
    starts another; ours hold on to what they freed, and map samples, on purpose. And who is killed
    can't tell its workers to stop.
    """
    process_executor._MAX_MEMORY_LEAK_SIZE = 1 << 62
    keep_freed_memory()

    threading.Thread(target=_end_with, args=(caller,), daemon=True).start()


def _end_with(caller: int) -> None:
    """End this process when its caller is gone."""
    if hasattr(os, "pidfd_open"):  # Linux says so at once
        with suppress(OSError):
            select.select([os.pidfd_open(caller)], [], [])
    while os.getppid() == caller:
        time.sleep(0.2)
    os._exit(1)


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

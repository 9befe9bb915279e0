"""Work shared out: over processes of this machine, or over machines with Dask."""

import ctypes
import os
import re
import signal
import socket
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext
from importlib.metadata import version
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import joblib
from joblib.externals.loky import process_executor
from joblib.externals.loky.backend import resource_tracker as loky_resource_tracker
from joblib.externals.loky.process_executor import TerminatedWorkerError

from afferents import outputs, plugins, progress, stopping
from afferents.errors import AfferentsError, InputError

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")
Job = tuple[Any, ...]

DEATHS = 3
"""So often a process may die with nothing come back in between; then all is given up."""

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3
"""Options of glibc's mallopt(3)."""

ANSWER_S = 10
"""A scheduler that does not answer for so long is not there."""
WORKERS_S = 30
"""How long a scheduler without workers is waited for."""
SAME = ("afferents", "torch")
"""Packages whose versions decide the numbers."""
OF_RECORDINGS = ("av", "numba", "numpy", "opencv-python-headless", "scipy")
"""Further ones that decide what is recorded and extracted, to the last byte."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://.+:\d+")


def side_by_side(
    function: Callable[..., Result],
    jobs: Iterable[Job],
    workers: int | None,
    note: Callable[[str], None] | None = None,
) -> Generator[Result, None, None]:
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
    with closing(side_by_side_numbered(function, jobs, workers, note)) as results:
        for _, result in results:
            yield result


def side_by_side_numbered(
    function: Callable[..., Result],
    jobs: Iterable[Job],
    workers: int | None,
    note: Callable[[str], None] | None = None,
) -> Generator[tuple[int, Result], None, None]:
    """Do the same; yield each result with the number of its job, from 0."""
    waiting, deaths = dict(enumerate(jobs)), 0
    while waiting:
        before = len(waiting)
        try:
            with closing(_do_jobs(function, list(waiting.items()), workers)) as results:
                for number, result in results:
                    del waiting[number]
                    yield number, result
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


def _do_jobs(
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
        calls = (joblib.delayed(_do_numbered)(here, number, function, *job) for number, job in jobs)
        with stopping.stop_later(), _block_terminal_signals() if n > 1 else nullcontext():
            results = pool(calls)
        try:
            for result in results:  # noqa: UP028 (closed below, without joblib's warning)
                yield result
        finally:
            with warnings.catch_warnings(action="ignore"):
                results.close()


@contextmanager
def _block_terminal_signals() -> Iterator[None]:
    """Start processes inside that a Ctrl-C or a closed terminal, meant for all, does not reach.

    It is for this process to stop them, and they would print what they were at.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows, where it reaches them
        yield
        return
    meant_for_all = {signal.SIGINT, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, meant_for_all)
    try:
        for tracker in (resource_tracker, loky_resource_tracker):
            tracker.ensure_running()  # which lets signals through again when it starts its own
        signal.pthread_sigmask(signal.SIG_BLOCK, meant_for_all)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _do_numbered(
    folder: Path, number: int, function: Callable[..., Result], *job: Any
) -> tuple[int, Result]:
    """Do a job in one thread, in the caller's folder.

    The folder may have changed since a process was started. With one worker this is the caller's
    process, whose libraries have a thread a core, and sums over several are rounded otherwise.
    """
    from threadpoolctl import threadpool_limits  # needed where there is work alone

    if Path.cwd() != folder:
        os.chdir(folder)
    with threadpool_limits(1):
        return number, function(*job)


def _prepare(caller: int) -> None:
    """Let a new process keep its memory, and end soon after the one that called.

    Where psutil is installed, loky takes a process that has grown by 300 MB for a leak, and
    starts another; ours hold on to what they freed, and map samples, on purpose. And who is killed
    can't tell its workers to stop.
    """
    process_executor._MAX_MEMORY_LEAK_SIZE = 1 << 62
    keep_freed_memory()
    progress.silence_libraries()
    threading.Thread(target=_end_after, args=(caller,), daemon=True).start()


def _end_after(caller: int) -> None:
    """End this process when its caller is gone."""
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


def on_cluster(
    function: Callable[..., Result],
    jobs: Iterable[Job],
    address: str,
    output: Path,
    packages: tuple[str, ...] = SAME,
) -> Generator[Result, None, None]:
    """Call `function(*job)` for every job on some worker; yield the results as they come.

    Workers are any machines that have this package, and see the same files. One that dies costs the
    job that it was at, which another one does anew. Joblib's Dask backend is not used: a worker
    that is killed again and again would leave it waiting.

    Parameters
    ----------
    jobs
        Light: they are sent as they are. What is large is read by the workers themselves.
    address
        Of the scheduler, such as ``tcp://scheduler:8786``.
    output
        Folder that this process is writing alone (`outputs.writing_alone`), and workers too.
    packages
        That workers must have in the version that is here.

    Raises
    ------
    InputError
        If there is no scheduler or no worker, or a worker with more than one thread, with another
        version of a package, or that does not see `output`.
    AfferentsError
        If a job killed several workers, the cluster went away, or a worker lacks a package. Errors
        of `function` pass through, and stop the jobs that wait.
    """
    with _client(address) as client:
        from distributed import as_completed

        here = {package: version(package) for package in packages}
        seen = output.resolve(), outputs.lock_text(output)
        waiting = as_completed(
            [client.submit(_do_as_here, here, *seen, function, *job, pure=False) for job in jobs],
            loop=client.loop,
        )  # type: ignore[no-untyped-call]
        for future in waiting:
            result = _take_result(future)
            del future  # a job whose future is kept is done anew when its worker dies
            yield result


def workers_at(address: str) -> int:
    """Return how many workers a cluster has.

    Raises
    ------
    InputError
        If there is no scheduler, or no worker.
    """
    with _client(address) as client:
        return len(client.nthreads())  # type: ignore[no-untyped-call]


def _do_as_here(
    versions: Mapping[str, str],
    output: Path,
    lock: str,
    function: Callable[..., Result],
    *job: Any,
) -> Result:
    """Do a job on a worker that would compute the same.

    Of two trainings in one process each would draw from the other's random numbers.
    """
    from distributed import get_worker

    worker = get_worker()
    who = f"worker {worker.address} on {socket.gethostname()}"
    if worker.state.nthreads != 1:
        raise InputError(
            f"{who}: expected one thread, found {worker.state.nthreads}; start it with --nthreads "
            "1, and as many workers as there are cores"
        )
    for package, expected in versions.items():
        if version(package) != expected:
            raise InputError(
                f"{who}: expected {package} {expected}, as where the command runs, found "
                f"{version(package)}; install the same version there"
            )
    if outputs.lock_text(output) != lock:
        raise InputError(
            f"{who}: expected to see {output} as it is where the command runs; let all workers see "
            "the same files at the same paths"
        )
    return function(*job)


def require_seen(paths: Iterable[str]) -> None:
    """Refuse, on a worker, files and folders of the caller's that are not there.

    Raises
    ------
    InputError
        Naming this machine and the first that is missing.
    """
    for path in paths:
        if not Path(path).exists():
            raise InputError(
                f"worker on {socket.gethostname()}: expected {path} as it is where the command "
                "runs, found none; let all workers see the same files at the same paths"
            )


@contextmanager
def _client(address: str) -> Iterator["Client"]:
    """Yield a cluster's client, once there is a worker."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            f"--cluster: expected Dask, found none installed; {plugins.how_to_install('cluster')}"
        ) from None
    if not _ADDRESS.fullmatch(address):  # Dask would try for half a minute
        raise InputError(
            f"--cluster: expected an address like tcp://scheduler:8786, found '{address}'"
        )
    try:  # not as Dask's default: whatever else computes with Dask here is none of its business
        client = Client(address, timeout=ANSWER_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise InputError(
            f"--cluster: expected a Dask scheduler at {address}, found none that answers; start "
            "one with 'dask scheduler', and workers with 'dask worker ADDRESS --nthreads 1'"
        ) from error
    try:
        try:
            client.wait_for_workers(1, timeout=WORKERS_S)
        except TimeoutError as error:
            raise InputError(
                f"--cluster: expected at least one worker at {address}, found none; start some "
                f"with 'dask worker {address} --nthreads 1'"
            ) from error
        yield client
    finally:
        client.close()  # type: ignore[no-untyped-call]


def _take_result(future: Any) -> Any:
    """Return what a job came to, or say in one sentence what became of it."""
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise AfferentsError(
            "a job killed its worker several times (out of memory?); what is finished is "
            "kept: run the same command again, with more memory a worker"
        ) from error
    except ImportError as error:
        raise AfferentsError(
            f"a worker lacks a package ({error}); what is finished is kept: install there what is "
            "here, and run the same command again"
        ) from error
    except CancelledError as error:
        raise AfferentsError(
            "the cluster went away; what is finished is kept: run the same command again"
        ) from error

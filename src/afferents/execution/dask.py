"""Jobs on a Dask cluster: any machines whose workers have this package and can read the data."""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from afferents.core.errors import AfferentsError, InputError
from afferents.core.files import size_of
from afferents.core.lock import is_locked_by
from afferents.core.owner import host_here

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")

ANSWER_S = 10
"""A scheduler that does not answer for so long is not there."""
WORKERS_S = 30
"""How long a scheduler without workers is waited for."""
SAME = ("afferents", "torch")
"""Packages whose versions decide the numbers."""
OF_RECORDINGS = ("av", "numba", "numpy", "opencv-python-headless", "scipy")
"""Further ones that decide what is recorded and extracted, to the last byte."""
AHEAD = 4
"""So many jobs a worker are with the scheduler at a time: none of them waits for the next, and
neither the jobs of a million recordings nor what comes back of them pile up anywhere."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://.+:\d+")
_ONE_THREAD = "start it with --nthreads 1, and as many workers as there are cores"


@dataclass(frozen=True)
class Output:
    """A folder that a command is writing, told from any other of the same path.

    Attributes
    ----------
    token
        Of the lock in it, which no other folder has; see `core.lock.writing_alone`.
    """

    folder: Path
    token: str

    @property
    def is_seen(self) -> bool:
        """Whether this process sees it too, and can write there itself."""
        return is_locked_by(self.folder, self.token) and os.access(self.folder, os.W_OK)


def on_cluster(
    function: Callable[..., Result],
    jobs: Iterable[tuple[Any, ...]],
    address: str,
    packages: tuple[str, ...] = SAME,
) -> Iterator[Result]:
    """Call `function(*job)` for every job on some worker; yield the results as they come.

    A worker that dies costs the job that it was at, which another one does anew.

    Parameters
    ----------
    jobs
        Light: they are sent as they are, `AHEAD` a worker. What is large is read by the workers
        themselves.
    address
        Of the scheduler, such as ``tcp://scheduler:8786``.
    packages
        That workers must have in the version that is here.

    Raises
    ------
    InputError
        If there is no scheduler, no worker, or a worker with more than one thread, without this
        package, or with another version of it; also if such a one joins later.
    AfferentsError
        If a job killed several workers, the cluster went away, or a worker that joined later
        lacks a package. Errors of `function` pass through, and stop the jobs that wait.
    """
    with _client(address) as client:
        from distributed import as_completed

        _require_workers(client, address, packages)
        here = {package: _installed(package) for package in packages}
        left = iter(jobs)
        # And nothing else keeps a future: what has come back is let go.
        waiting = as_completed(loop=client.loop)  # type: ignore[no-untyped-call]

        def hand_out() -> None:
            for job in islice(left, _room(client, waiting.count())):  # type: ignore[no-untyped-call]
                waiting.add(client.submit(_as_here, here, function, *job, pure=False))  # type: ignore[no-untyped-call]

        hand_out()
        for future in waiting:
            result = _result(future)
            del future
            hand_out()
            yield result
            del result


def _room(client: "Client", waiting: int) -> int:
    """Return how many more jobs the workers that are there now should have; one if none waits."""
    workers = int(client.scheduler_info(n_workers=0)["n_workers"])
    return max(AHEAD * workers - waiting, 0 if waiting else 1)


def workers_at(address: str) -> int:
    """Return how many workers a cluster has.

    Raises
    ------
    InputError
        As `on_cluster`.
    """
    with _client(address) as client:
        return _require_workers(client, address, SAME)


def require_same_file(path: Path, size: int) -> None:
    """Refuse to go on, on a worker, where a file is not as it is where the command runs.

    Raises
    ------
    InputError
        If it is not there, or of another size in bytes.
    """
    found = size_of(path) if path.exists() else None
    if found != size:
        raise InputError(
            f"worker on {host_here()}",
            f"{path} as it is where the command runs ({size} bytes)",
            "none" if found is None else f"{found} bytes",
            "let all workers see the same files at the same paths",
        )


def _as_here(versions: Mapping[str, str], function: Callable[..., Result], *job: Any) -> Result:
    """Do a job on a worker, after checking it: it may have joined after all others were."""
    from distributed import get_worker

    worker = get_worker()
    _require_one_thread(worker.address, worker.state.nthreads)
    for package, expected in versions.items():
        _require_version(worker.address, package, expected, _there(package))
    return function(*job)


@lru_cache
def _there(package: str) -> str:
    """Return a package's version, which every job asks for and which does not change."""
    return version(package)


@contextmanager
def _client(address: str) -> Iterator["Client"]:
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "--cluster", "Dask", "none installed", "pip install 'afferents[cluster]'"
        ) from None
    if not _ADDRESS.fullmatch(address):  # Dask would try for half a minute
        raise InputError("--cluster", "an address like tcp://scheduler:8786", f"'{address}'")
    try:  # not as Dask's default: whatever else computes with Dask here is none of its business
        client = Client(address, timeout=ANSWER_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise InputError(
            "--cluster",
            f"a Dask scheduler at {address}",
            "none that answers",
            "start one with 'dask scheduler', and workers with 'dask worker ADDRESS --nthreads 1'",
        ) from error
    try:
        yield client
    finally:
        client.close()  # type: ignore[no-untyped-call]


def _require_workers(client: "Client", address: str, packages: tuple[str, ...]) -> int:
    """Count the workers; refuse none, and those that would not compute the same.

    Of two trainings in one process each would draw from the other's random numbers.
    """
    with suppress(TimeoutError):
        client.wait_for_workers(1, timeout=WORKERS_S)
    threads_of = client.nthreads()  # type: ignore[no-untyped-call]
    for worker, threads in threads_of.items():
        _require_one_thread(worker, threads)
    for package in packages:
        here = _installed(package)
        found = client.run(version, package, on_error="return")
        if not found:
            expected = f"at least one worker at {address}"
            hint = f"start some with 'dask worker {address} --nthreads 1'"
            raise InputError("--cluster", expected, "none", hint)
        for worker, there in found.items():
            _require_version(worker, package, here, there)
    return len(threads_of)


def _require_one_thread(worker: str, threads: int) -> None:
    if threads != 1:
        raise InputError(f"worker {worker}", "one thread", f"{threads}", _ONE_THREAD)


def _require_version(worker: str, package: str, here: str, there: str | Exception) -> None:
    """Refuse a worker with another version of a package; an error stands for none at all."""
    if there != here:
        raise InputError(
            f"worker {worker}",
            f"{package} {here}, as here",
            "none" if isinstance(there, Exception) else f"{there}",
            "install the same version there",
        )


def _installed(package: str) -> str:
    return version(package)


def _result(future: Any) -> Any:
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
            f"a worker that joined late lacks a package ({error}); what is finished is kept: "
            "install there what is here, and run the same command again"
        ) from error
    except CancelledError as error:
        raise AfferentsError(
            "the cluster went away; what is finished is kept: run the same command again"
        ) from error

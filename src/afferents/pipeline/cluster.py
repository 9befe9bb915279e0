"""Jobs on a Dask cluster: any machines whose workers have this package and can read the data."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, TypeVar

from afferents.core.errors import AfferentsError, InputError

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")

ANSWER_S = 10
"""A scheduler that does not answer for so long is not there."""
WORKERS_S = 30
"""How long a scheduler without workers is waited for."""
SAME = ("afferents", "torch")
"""Packages whose versions decide the numbers."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://.+:\d+")
_ONE_THREAD = "start it with --nthreads 1, and as many workers as there are cores"


def on_cluster(
    function: Callable[..., Result], jobs: Sequence[tuple[Any, ...]], address: str
) -> Iterator[Result]:
    """Call `function(*job)` for every job on some worker; yield the results as they come.

    A worker that dies costs the job that it was at, which another one does anew.

    Parameters
    ----------
    jobs
        Light: they are sent as they are. What is large is read by the workers themselves.
    address
        Of the scheduler, such as ``tcp://scheduler:8786``.

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

        _require_workers(client, address)
        here = {package: _installed(package) for package in SAME}
        waiting = as_completed(  # and nothing else keeps a future: what has come back is let go
            [client.submit(_as_here, here, function, *job, pure=False) for job in jobs],
            loop=client.loop,
        )  # type: ignore[no-untyped-call]
        for future in waiting:
            yield _result(future)
            del future


def workers_at(address: str) -> int:
    """Return how many workers a cluster has.

    Raises
    ------
    InputError
        As `on_cluster`.
    """
    with _client(address) as client:
        return _require_workers(client, address)


def _as_here(versions: Mapping[str, str], function: Callable[..., Result], *job: Any) -> Result:
    """Do a job on a worker, after checking it: it may have joined after all others were."""
    from distributed import get_worker

    worker = get_worker()
    _require_one_thread(worker.address, worker.state.nthreads)
    for package, expected in versions.items():
        _require_version(worker.address, package, expected, version(package))
    return function(*job)


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


def _require_workers(client: "Client", address: str) -> int:
    """Count the workers; refuse none, and those that would not compute the same.

    Of two trainings in one process each would draw from the other's random numbers.
    """
    with suppress(TimeoutError):
        client.wait_for_workers(1, timeout=WORKERS_S)
    threads_of = client.nthreads()  # type: ignore[no-untyped-call]
    for worker, threads in threads_of.items():
        _require_one_thread(worker, threads)
    for package in SAME:
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
            "a training killed its worker several times (out of memory?); what is finished is "
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

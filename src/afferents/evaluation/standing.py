"""How far an evaluation has come: what is planned, running, failed and done, from its folder.

Jobs leave a mark beside the folder that they will write: ``<speed>.running`` while they train,
``<speed>.failed`` if they could not. A mark says which process on which machine made it, so a
run that was killed is told from one at work.
"""

import os
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from typing import Any, Literal

from afferents.core.errors import InputError
from afferents.core.files import read_json, write_json
from afferents.core.results import CONFIG
from afferents.evaluation.folds import FOLD, PLAN, FoldKey, finished

State = Literal["done", "running", "failed", "stopped", "to do"]


@dataclass(frozen=True)
class Standing:
    """Where one job stands.

    Attributes
    ----------
    state
        ``stopped`` is a job whose process is gone without a word: killed, or out of memory.
    seconds
        That it took, or has taken so far; None where it has not begun.
    why
        It failed.
    """

    key: FoldKey
    state: State
    seconds: float | None = None
    why: str = ""


def plan(results: Path, keys: Iterable[FoldKey], workers: int, cluster: str | None = None) -> None:
    """Write down what is to be done, beside what was planned before and begun to be kept.

    Parameters
    ----------
    workers
        Trainings side by side.
    cluster
        Where they are, if not on this machine.
    """
    begun = (results / PLAN).is_file() and (results / CONFIG).is_file()
    earlier = read_json(results / PLAN, "a plan")["jobs"] if begun else []
    jobs = {tuple(job.values()): job for job in [*earlier, *(asdict(key) for key in keys)]}
    content = {"workers": workers, "cluster": cluster, "jobs": list(jobs.values())}
    write_json(results / PLAN, content)


@contextmanager
def at_work(results: Path, key: FoldKey) -> Iterator[None]:
    """Mark a job as running inside, and as failed if it raises."""
    running, failed = _mark(results, key, "running"), _mark(results, key, "failed")
    failed.unlink(missing_ok=True)
    write_json(running, {"host": socket.gethostname(), "pid": os.getpid(), "since": time.time()})
    try:
        yield
    except Exception as error:
        write_json(failed, {"why": str(error) or type(error).__name__})
        raise
    finally:
        running.unlink(missing_ok=True)


def has_failed(results: Path, key: FoldKey) -> bool:
    """Tell whether a job failed when it was last tried."""
    return _mark(results, key, "failed").is_file()


def standings(results: Path) -> list[Standing]:
    """Return where every planned job stands, in the order of the plan.

    Raises
    ------
    InputError
        If nothing was planned in this folder.
    """
    if not (results / PLAN).is_file():
        raise InputError(results, "a results folder that evaluate has begun", "none")
    jobs = read_json(results / PLAN, "a plan")["jobs"]
    return [_standing(results, FoldKey(**job)) for job in jobs]


def seconds_left(found: list[Standing], workers: int) -> float | None:
    """Return how long what is not done will take, s, if it goes on as so far; None if none knows.

    A job takes what others of its model took.
    """
    took: dict[str, list[float]] = {}
    for standing in found:
        if standing.state == "done" and standing.seconds is not None:
            took.setdefault(standing.key.model, []).append(standing.seconds)
    if not took:
        return None
    usual = mean(seconds for each in took.values() for seconds in each)
    left = 0.0
    for standing in found:
        if standing.state != "done":
            known = took.get(standing.key.model)
            begun = standing.seconds if standing.state == "running" else None
            left += max(0.0, (mean(known) if known else usual) - (begun or 0.0))
    return left / workers


def planned_workers(results: Path) -> tuple[int, str | None]:
    """Return how many processes the last run had, and on which cluster, if on one."""
    planned = read_json(results / PLAN, "a plan")
    return int(planned["workers"]), planned.get("cluster")


def _standing(results: Path, key: FoldKey) -> Standing:
    if finished(results, key):
        facts = read_json(key.folder(results) / FOLD, "a fold")
        return Standing(key, "done", facts.get("job_seconds", facts["seconds"]))
    failed, running = _mark(results, key, "failed"), _mark(results, key, "running")
    if failed.is_file():
        return Standing(key, "failed", why=read_json(failed, "a mark")["why"])
    if running.is_file():
        mark = read_json(running, "a mark")
        state: State = "running" if _alive(mark) else "stopped"
        return Standing(key, state, time.time() - mark["since"])
    return Standing(key, "to do")


def _alive(mark: dict[str, Any]) -> bool:
    """Say whether the process that left a mark is there; of another machine nobody knows."""
    if mark["host"] != socket.gethostname():
        return True
    try:
        os.kill(mark["pid"], 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _mark(results: Path, key: FoldKey, state: str) -> Path:
    folder = key.folder(results)
    return folder.with_name(f"{folder.name}.{state}")

"""How far an evaluation has come: what is planned, running, failed and done, from its folder.

Jobs leave a mark beside the folder that they will write: ``<group>.running`` while they train,
``<group>.failed`` if they could not. A mark says which process on which machine made it, so a
run that was killed is told from one at work.
"""

import os
import socket
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Literal

from pydantic import Field

from afferents.errors import InputError
from afferents.evaluation.fold_files import FOLD, PLAN, FoldKey, finished, read_facts
from afferents.evaluation.results import CONFIG
from afferents.evaluation.schemas import Schema
from afferents.folds.held_out import Amount

_REMOVE = "remove it: it is only shown"

State = Literal["done", "running", "failed", "stopped", "to do"]


class Plan(Schema):
    """`plan.json`: the trainings asked for, and by how many processes."""

    workers: int = Field(ge=1)
    """Trainings side by side."""
    cluster: str | None
    """Address of a Dask scheduler, if not on this machine."""
    jobs: tuple[FoldKey, ...]
    """The folds."""


class Running(Schema):
    """``<group>.running``: which process trains the fold now."""

    host: str
    """Name of the machine."""
    pid: int = Field(ge=1, lt=1 << 31)
    """Number of the process."""
    since: Amount
    """Seconds since 1970."""


class Failed(Schema):
    """``<group>.failed``: why a fold could not be trained."""

    why: str
    """The error, in a sentence."""


@dataclass(frozen=True)
class JobStatus:
    """The status of one job.

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
    earlier = read_plan(results).jobs if begun else ()
    jobs = tuple(dict.fromkeys([*earlier, *keys]))
    Plan(workers=workers, cluster=cluster, jobs=jobs).write(results / PLAN)


def read_plan(results: Path) -> Plan:
    """Return what is planned in a folder."""
    return Plan.read(results / PLAN, "a plan of trainings", _REMOVE)


@contextmanager
def at_work(results: Path, key: FoldKey) -> Iterator[None]:
    """Mark a job as running inside, and as failed if it raises."""
    running, failed = key.mark(results, "running"), key.mark(results, "failed")
    failed.unlink(missing_ok=True)
    Running(host=socket.gethostname(), pid=os.getpid(), since=time.time()).write(running)
    try:
        yield
    except Exception as error:
        Failed(why=str(error) or type(error).__name__).write(failed)
        raise
    finally:
        running.unlink(missing_ok=True)


def has_failed(results: Path, key: FoldKey) -> bool:
    """Tell whether a job failed when it was last tried."""
    return key.mark(results, "failed").is_file()


def job_statuses(results: Path) -> list[JobStatus]:
    """Return the status of every planned job, in the order of the plan.

    Raises
    ------
    InputError
        If nothing was planned in this folder.
    """
    if not (results / PLAN).is_file():
        raise InputError(
            f"{results}: expected a results folder that evaluate has begun, found none"
        )
    return [_job_status(results, key) for key in read_plan(results).jobs]


def seconds_left(found: list[JobStatus], workers: int) -> float | None:
    """Return how long what is not done will take, s, if it goes on as so far; None if none knows.

    A job takes what others of its model took.
    """
    took: dict[str, list[float]] = {}
    for status in found:
        if status.state == "done" and status.seconds is not None:
            took.setdefault(status.key.model, []).append(status.seconds)
    if not took:
        return None
    of_any = [seconds for each in took.values() for seconds in each]
    left = 0.0
    for status in found:
        if status.state != "done":
            begun = status.seconds if status.state == "running" else None
            left += max(0.0, mean(took.get(status.key.model, of_any)) - (begun or 0.0))
    return left / workers


def _job_status(results: Path, key: FoldKey) -> JobStatus:
    if finished(results, key):
        facts = read_facts(key.folder(results) / FOLD)
        seconds = facts.seconds if facts.job_seconds is None else facts.job_seconds
        return JobStatus(key, "done", seconds)
    failed, running = key.mark(results, "failed"), key.mark(results, "running")
    if failed.is_file():
        return JobStatus(key, "failed", why=Failed.read(failed, "a mark", _REMOVE).why)
    if running.is_file():
        mark = Running.read(running, "a mark", _REMOVE)
        state: State = "running" if _alive(mark) else "stopped"
        return JobStatus(key, state, time.time() - mark.since)
    return JobStatus(key, "to do")


def _alive(mark: Running) -> bool:
    """Say whether the process that left a mark is there; of another machine nobody knows."""
    if mark.host != socket.gethostname() or sys.platform == "win32":
        return True  # on Windows, os.kill does not ask: 0 is its Ctrl-C
    try:
        os.kill(mark.pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True

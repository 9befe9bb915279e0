"""What a reproduction began with, and how far it or an evaluation has come."""

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from afferents.choices import Like
from afferents.documents import as_form, read_json
from afferents.evaluation.fold_files import (
    PLAN,
    JobStatus,
    State,
    job_statuses,
    read_plan,
    seconds_left,
)
from afferents.evaluation.results import Schema
from afferents.files import require_same_config, write_json
from afferents.outputs import is_locked
from afferents.recordings.session_file import session_file
from afferents.store.zarr_store import recordings_there

REPORT = "report.html"
"""In the results."""
STATE_FILE = "reproduction.json"
"""In its folder: what was chosen."""
_WHAT, _AGAIN = "what a reproduction began with", "choose another folder"
_FREE = frozenset({"protocol", "models"})
"""Choices that one folder may hold several of: trainings are added."""


class RunState(Schema):
    """`reproduction.json`: what a folder's reproduction began with."""

    like: Like
    choices: dict[str, str]
    otherwise: tuple[str, ...]
    differs: tuple[str, ...]
    recordings: int
    since: float = Field(default_factory=time.time)


@dataclass(frozen=True)
class RunFolder:
    """Where a reproduction puts what.

    Attributes
    ----------
    out
        Holds `session/` (where one is simulated), `session.zarr/` and `results/` afterwards.
    """

    out: Path

    @property
    def session(self) -> Path:
        """Where a session is simulated."""
        return self.out / "session"

    @property
    def store(self) -> Path:
        """Where the responses go."""
        return self.out / "session.zarr"

    @property
    def results(self) -> Path:
        """Where folds, table, figures and report go."""
        return self.out / "results"

    @property
    def state_file(self) -> Path:
        """What it began with."""
        return self.out / STATE_FILE

    def write_state(self, state: RunState) -> None:
        """Write down what it begins with, for `status` and for whoever reads it later."""
        write_json(self.state_file, state.model_dump())

    def read_state(self) -> RunState:
        """Return what it began with.

        Raises
        ------
        InputError
            If the file is damaged.
        """
        content = read_json(self.state_file, _WHAT, _AGAIN)
        return as_form(content, RunState, self.state_file, _WHAT, _AGAIN)

    def require_same(self, like: Like, choices: Mapping[str, str]) -> None:
        """Refuse to go on with a reproduction of other choices.

        Raises
        ------
        InputError
            Naming the first that differs.
        """
        if self.state_file.is_file():
            found = self.read_state()
            earlier, wanted = (
                {"like": of, **{n: v for n, v in its.items() if n not in _FREE}}
                for of, its in ((found.like, found.choices), (like, choices))
            )
            require_same_config(self.out, "a reproduction", earlier, wanted)


# What an evaluation, or a reproduction, has done so far, in words and as a table.

_GO_ON = "Nothing is running; the same command goes on where it stopped."
STATES: tuple[State, ...] = ("done", "running", "to do", "failed", "stopped")


@dataclass(frozen=True)
class Status:
    """Jobs by model and protocol, sentences, and all of it for scripts."""

    rows: list[tuple[str, ...]]
    sentences: list[str]
    facts: dict[str, Any]


def status(folder: Path) -> Status:
    """Look at a results folder, or at that of a reproduction; nothing in it is touched.

    Raises
    ------
    InputError
        If none was begun there.
    """
    run = RunFolder(folder)
    if run.state_file.is_file():
        return _of_reproduction(run)
    if session_file(run.session).simulated:
        now = is_locked(run.session)
        said = f"A session {'is being' if now else 'was in part'} simulated; nothing is extracted."
        return Status([], [said] if now else [said, _GO_ON], {"recordings": None, "extracted": 0})
    return _of_results(folder)


def _of_reproduction(run: RunFolder) -> Status:
    """Return how far extraction, trainings and report are."""
    state = run.read_state()
    there, extracting = recordings_there(run.store), is_locked(run.store)
    begins = f"{there} of {state.recordings} recordings are extracted"
    said = [f"{begins}{', and more are being' if extracting else ''}."]
    planned = (run.results / PLAN).is_file()
    trained = _of_results(run.results, goes_on=extracting) if planned else None
    said += trained.sentences if trained else ["No training has begun."]
    page = run.results / REPORT
    if page.is_file():
        said.append(f"Report: {page}")
    facts = {
        "like": state.like,
        "recordings": state.recordings,
        "extracted": there,
        "report": str(page) if page.is_file() else None,
        "trainings": trained.facts if trained else None,
    }
    return Status(trained.rows if trained else [], said, facts)


def _of_results(results: Path, goes_on: bool = False) -> Status:
    """Return how far trainings are; `goes_on` where what comes before them is running."""
    found = job_statuses(results)
    counts = Counter(standing.state for standing in found)
    plan = read_plan(results)
    left = seconds_left(found, plan.workers)
    facts = {
        "counts": {state: counts[state] for state in STATES},
        "seconds_left": left,
        "jobs": [{**s.key.content(), "state": s.state, "why": s.why} for s in found],
    }
    return Status(_rows(found), _sentences(found, counts, left, plan.cluster, goes_on), facts)


def _rows(found: list[JobStatus]) -> list[tuple[str, ...]]:
    """Return a row a model and protocol: the number of its jobs in each state."""
    groups: dict[tuple[str, str], Counter[State]] = {}
    for standing in found:
        of_group = groups.setdefault((standing.key.model, standing.key.protocol), Counter())
        of_group[standing.state] += 1
    return [(*group, *(str(n[state] or "") for state in STATES)) for group, n in groups.items()]


def _sentences(
    found: list[JobStatus],
    counts: Counter[State],
    left: float | None,
    cluster: str | None,
    goes_on: bool,
) -> list[str]:
    said = [f"{counts['done']} of {len(found)} trainings are done."]
    said += [f"Running: {s.key}, for {duration(s.seconds or 0)}." for s in found
             if s.state == "running"]  # fmt: skip
    said += [f"Failed: {s.key}: {s.why}" for s in found if s.state == "failed"]
    if counts["stopped"]:
        said.append(f"{counts['stopped']} were stopped with their process: killed, or no memory.")
    if counts["done"] == len(found):
        return said
    if not counts["running"] and cluster is not None:
        said.append(f"Workers at {cluster} that don't see this folder leave no mark in it.")
    elif not counts["running"]:
        return said if goes_on else [*said, _GO_ON]
    if left is not None:
        end = _clock(time.time() + left)
        said.append(f"Expected end: {end}, in {duration(left)}{_unless(found)}.")
    return said


def _clock(at: float) -> str:
    return time.strftime("%H:%M on %d %b", time.localtime(at))


def _unless(found: list[JobStatus]) -> str:
    """Return what an expected end assumes of models of which no training has ended."""
    ended = {s.key.model for s in found if s.state == "done"}
    unknown = list(dict.fromkeys(s.key.model for s in found if s.key.model not in ended))
    if not unknown:
        return ""
    return f", taking {', '.join(unknown)} (none ended yet) to be like the others"


def duration(seconds: float) -> str:
    """Return a time in words: ``0.4 s``, ``40 s``, ``12 min``, ``3 h 20 min``, ``52 h 00 min``."""
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 9.5 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"

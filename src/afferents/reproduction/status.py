"""The folder of a reproduction: where it puts what, what it began with, how far it has come.

How far an evaluation alone has come is said as well, in sentences and as a table.
"""

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from afferents import documents, files, outputs
from afferents.choices import Like
from afferents.evaluation import fold_files
from afferents.evaluation.results import Schema
from afferents.recordings.session_file import read_session_file
from afferents.store.zarr_store import recordings_there

STATE_FILE = "reproduction.json"
"""In its folder: what was chosen."""
_WHAT, _AGAIN = "what a reproduction began with", "choose another folder"
_FREE = frozenset({"protocol", "models"})
"""Choices that one folder may hold several of: trainings are added."""
REPORT = "report.html"
"""In the results."""
STATES: tuple[fold_files.State, ...] = ("done", "running", "to do", "failed", "stopped")
_GO_ON = "Nothing is running; the same command goes on where it stopped."


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
        files.write_json(self.state_file, state.model_dump())

    def read_state(self) -> RunState:
        """Return what it began with.

        Raises
        ------
        InputError
            If the file is damaged.
        """
        content = documents.read_json(self.state_file, _WHAT, _AGAIN)
        return documents.as_form(content, RunState, self.state_file, _WHAT, _AGAIN)

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
            files.require_same_config(self.out, "a reproduction", earlier, wanted)


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
        return _check_reproduction(run)
    if read_session_file(run.session).simulated:
        now = outputs.is_locked(run.session)
        sentence = (
            f"A session {'is being' if now else 'was in part'} simulated; nothing is extracted."
        )
        sentences = [sentence] if now else [sentence, _GO_ON]
        return Status([], sentences, {"recordings": None, "extracted": 0})
    return _check_results(folder)


def _check_reproduction(run: RunFolder) -> Status:
    """Return how far extraction, trainings and report are."""
    state = run.read_state()
    there, extracting = recordings_there(run.store), outputs.is_locked(run.store)
    more = ", and more are being" if extracting else ""
    sentences = [f"{there} of {state.recordings} recordings are extracted{more}."]
    planned = (run.results / fold_files.PLAN).is_file()
    trained = _check_results(run.results, goes_on=extracting) if planned else None
    sentences += trained.sentences if trained else ["No training has begun."]
    page = run.results / REPORT
    if page.is_file():
        sentences.append(f"Report: {page}")
    facts = {
        "like": state.like,
        "recordings": state.recordings,
        "extracted": there,
        "report": str(page) if page.is_file() else None,
        "trainings": trained.facts if trained else None,
    }
    return Status(trained.rows if trained else [], sentences, facts)


def _check_results(results: Path, goes_on: bool = False) -> Status:
    """Return how far trainings are; `goes_on` where what comes before them is running."""
    jobs, plan = fold_files.job_statuses(results), fold_files.read_plan(results)
    left = fold_files.seconds_left(jobs, plan.workers)
    counts: Counter[fold_files.State] = Counter(job.state for job in jobs)
    groups: dict[tuple[str, str], Counter[fold_files.State]] = {}
    for job in jobs:
        groups.setdefault((job.key.model, job.key.protocol), Counter())[job.state] += 1
    facts = {
        "counts": {state: counts[state] for state in STATES},
        "seconds_left": left,
        "jobs": [{**job.key.content(), "state": job.state, "why": job.why} for job in jobs],
    }
    rows = [(*group, *(str(n[state] or "") for state in STATES)) for group, n in groups.items()]
    sentences = [f"{counts['done']} of {len(jobs)} trainings are done."]
    sentences += [f"Running: {job.key}, for {format_duration(job.seconds or 0)}." for job in jobs
                  if job.state == "running"]  # fmt: skip
    sentences += [f"Failed: {job.key}: {job.why}" for job in jobs if job.state == "failed"]
    if counts["stopped"]:
        sentences.append(
            f"{counts['stopped']} were stopped with their process: killed, or no memory."
        )
    found = Status(rows, sentences, facts)
    if counts["done"] == len(jobs):
        return found
    if not counts["running"] and plan.cluster is not None:
        sentences.append(
            f"Workers at {plan.cluster} that don't see this folder leave no mark in it."
        )
    elif not counts["running"]:
        sentences += [] if goes_on else [_GO_ON]
        return found
    if left is not None:
        ended = {job.key.model for job in jobs if job.state == "done"}
        unknown = ", ".join(dict.fromkeys(j.key.model for j in jobs if j.key.model not in ended))
        taking = f", taking {unknown} (none ended yet) to be like the others" if unknown else ""
        end = time.strftime("%H:%M on %d %b", time.localtime(time.time() + left))
        sentences.append(f"Expected end: {end}, in {format_duration(left)}{taking}.")
    return found


def format_duration(seconds: float) -> str:
    """Return a time in words: ``0.4 s``, ``40 s``, ``12 min``, ``3 h 20 min``, ``52 h 00 min``."""
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 9.5 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"

"""How far an evaluation, or a reproduction, has come: in sentences and as a table."""

import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.evaluation.fold_files import PLAN, State, job_statuses, read_plan, seconds_left
from afferents.outputs import is_locked
from afferents.recordings.session_file import read_session_file
from afferents.reproduction.run_folder import RunFolder
from afferents.store.zarr_store import recordings_there

REPORT = "report.html"
"""In the results."""
STATES: tuple[State, ...] = ("done", "running", "to do", "failed", "stopped")
_GO_ON = "Nothing is running; the same command goes on where it stopped."


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
        now = is_locked(run.session)
        sentence = (
            f"A session {'is being' if now else 'was in part'} simulated; nothing is extracted."
        )
        sentences = [sentence] if now else [sentence, _GO_ON]
        return Status([], sentences, {"recordings": None, "extracted": 0})
    return _check_results(folder)


def _check_reproduction(run: RunFolder) -> Status:
    """Return how far extraction, trainings and report are."""
    state = run.read_state()
    there, extracting = recordings_there(run.store), is_locked(run.store)
    more = ", and more are being" if extracting else ""
    sentences = [f"{there} of {state.recordings} recordings are extracted{more}."]
    planned = (run.results / PLAN).is_file()
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
    jobs, plan = job_statuses(results), read_plan(results)
    left = seconds_left(jobs, plan.workers)
    counts: Counter[State] = Counter(job.state for job in jobs)
    groups: dict[tuple[str, str], Counter[State]] = {}
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

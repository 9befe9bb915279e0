"""What an evaluation, or a reproduction, has done so far, in words and as a table."""

import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.core.lock import is_locked
from afferents.core.store import recordings_there
from afferents.evaluation import (
    PLAN,
    JobStatus,
    State,
    job_statuses,
    planned_workers,
    seconds_left,
)
from afferents.pipeline.begun import REPORT, Places, read_begun

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
    places = Places(folder)
    return _of_reproduction(places) if places.begun.is_file() else _of_results(folder)


def _of_reproduction(places: Places) -> Status:
    """Return how far extraction, trainings and report are."""
    begun = read_begun(places)
    there = recordings_there(places.store)
    begins = f"{there} of {begun.recordings} recordings are extracted"
    said = [f"{begins}{', and more are being' if is_locked(places.store) else ''}."]
    trained = _of_results(places.results) if (places.results / PLAN).is_file() else None
    said += trained.sentences if trained else ["No training has begun."]
    page = places.results / REPORT
    if page.is_file():
        said.append(f"Report: {page}")
    elif begun.estimated_s is not None:
        end = _clock(begun.since + begun.estimated_s)
        took = _duration(begun.estimated_s)
        said.append(f"Estimated before it began: {took}, until {end} if nothing stopped it.")
    facts = {
        "like": begun.like,
        "recordings": begun.recordings,
        "extracted": there,
        "report": str(page) if page.is_file() else None,
        "estimated_s": begun.estimated_s,
        "trainings": trained.facts if trained else None,
    }
    return Status(trained.rows if trained else [], said, facts)


def _of_results(results: Path) -> Status:
    found = job_statuses(results)
    counts = Counter(standing.state for standing in found)
    workers, cluster = planned_workers(results)
    left = seconds_left(found, workers)
    facts = {
        "counts": {state: counts[state] for state in STATES},
        "seconds_left": left,
        "jobs": [{**s.key.describe(), "state": s.state, "why": s.why} for s in found],
    }
    return Status(_rows(found), _sentences(found, counts, left, cluster), facts)


def _rows(found: list[JobStatus]) -> list[tuple[str, ...]]:
    """Return a row a model and protocol: the number of its jobs in each state."""
    groups: dict[tuple[str, str], Counter[State]] = {}
    for standing in found:
        of_group = groups.setdefault((standing.key.model, standing.key.protocol), Counter())
        of_group[standing.state] += 1
    return [(*group, *(str(n[state] or "") for state in STATES)) for group, n in groups.items()]


def _sentences(
    found: list[JobStatus], counts: Counter[State], left: float | None, cluster: str | None
) -> list[str]:
    said = [f"{counts['done']} of {len(found)} trainings are done."]
    said += [f"Running: {s.key}, for {_duration(s.seconds or 0)}." for s in found
             if s.state == "running"]  # fmt: skip
    said += [f"Failed: {s.key}: {s.why}" for s in found if s.state == "failed"]
    if counts["stopped"]:
        said.append(f"{counts['stopped']} were stopped with their process: killed, or no memory.")
    if counts["done"] == len(found):
        return said
    if not counts["running"] and cluster is not None:
        said.append(f"Workers at {cluster} that don't see this folder leave no mark in it.")
    elif not counts["running"]:
        return [*said, "Nothing is running; the same command goes on where it stopped."]
    if left is not None:
        end = _clock(time.time() + left)
        said.append(f"Expected end: {end}, in {_duration(left)}{_unless(found)}.")
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


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"

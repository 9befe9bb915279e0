"""What an evaluation has done so far, in words and as a table."""

import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.evaluation import (
    JobStatus,
    State,
    job_statuses,
    planned_workers,
    seconds_left,
)

STATES: tuple[State, ...] = ("done", "running", "to do", "failed", "stopped")


@dataclass(frozen=True)
class Status:
    """Jobs by model and protocol, sentences, and all of it for scripts."""

    rows: list[tuple[str, ...]]
    sentences: list[str]
    facts: dict[str, Any]


def status(results: Path) -> Status:
    """Look at a results folder; nothing in it is touched.

    Raises
    ------
    InputError
        If no evaluation was begun there.
    """
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
        return [*said, "Nothing is running; the same evaluate command goes on where it stopped."]
    if left is not None:
        end = time.strftime("%H:%M on %d %b", time.localtime(time.time() + left))
        said.append(f"Expected end: {end}, in {_duration(left)}{_unless(found)}.")
    return said


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

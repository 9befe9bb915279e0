"""In words: what the intervals of a results folder were drawn over, and what they do not say."""

from typing import Any

from afferents.core.replicate import SESSION
from afferents.core.split import split_of

FEW_SESSIONS = 5
"""Below so many an interval over sessions is wide for want of sessions alone."""


def drawn_over(summary: dict[str, Any]) -> str:
    """Return what was drawn anew: `13 textures, each with all its speeds`, `5 sessions`."""
    found = summary.get("intervals")
    if found is None:
        return "recordings"
    if found["replicate"] == SESSION:
        return f"{found['n']} sessions"
    return f"{found['n']} textures, each with all its {split_of(summary).many}"


def interval_note(summary: dict[str, Any]) -> str:
    """Return how 95% intervals were made and what they leave out, in a few sentences."""
    found, over = summary.get("intervals"), drawn_over(summary)
    made = f"95% intervals are drawn over {over}, and over training seeds."
    if found is None:
        return (
            f"{made} This folder was written by an earlier version: recordings of one texture are "
            "no independent trials, so the intervals are too narrow. To have them over textures, "
            "repeat the command at the end of this page; finished trainings are kept."
        )
    if found["replicate"] == SESSION:
        few = f" {found['n']} are few, and few make them wide." if found["n"] < FEW_SESSIONS else ""
        return f"{made} So they say how much a further session like these may differ.{few}"
    return (
        f"{made} So they say how much other textures like these may differ in this one session. "
        "They do not say how much another session would: another day, mounting or sensor."
    )

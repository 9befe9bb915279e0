"""What a store says of its recordings: what is wrong with them, and which seem to be copies."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents import dims
from afferents.markers.rest import rest_sentences
from afferents.progress import Progress
from afferents.quality.issues import describe_issues
from afferents.store import integrity, zarr_store
from afferents.store.fingerprint import Copy, Fingerprint, find_copies, fingerprint, read, written
from afferents.store.motion import NORMAL, force_sentences
from afferents.store.responses import Responses, issues_in

FINGERPRINT = "fingerprint"
"""Attribute of a recording's responses that holds its fingerprint."""
NAMED = 3
"""This many pairs are named in a warning."""


@dataclass(frozen=True)
class Notes:
    """What is to be reported of recordings: issues by name, copies, rest frames, signs of force."""

    issues: dict[str, list[str]]
    copies: list[Copy]
    at_rest: list[str]
    of_force: list[str]

    @property
    def sentences(self) -> list[str]:
        """Describe it, a sentence a kind."""
        return [*describe_issues(self.issues), *self.at_rest, *warn_of_copies(self.copies)]


def add_fingerprint(responses: Responses) -> Responses:
    """Return responses with the recording's fingerprint in their attributes."""
    return responses.assign_attrs({FINGERPRINT: json.dumps(written(fingerprint(responses)))})


def read_notes(store: Path) -> Notes:
    """Return what is to be reported of the recordings in a store; nothing where there is none."""
    names = zarr_store.store_config(store)["recordings"] if integrity.is_group(store) else []
    return make_notes(zarr_store.stored_attributes(store, names))


def make_notes(attributes: Mapping[str, Mapping[str, Any]]) -> Notes:
    """Return what is to be reported of recordings, by the attributes of their responses."""
    issues = {name: found for name, one in attributes.items() if (found := issues_in(one))}
    of_force = force_sentences(str(one.get(NORMAL, "")) for one in attributes.values())
    prints: dict[str, Fingerprint] = {}
    for name, one in attributes.items():
        try:
            prints[name] = read(json.loads(one[FINGERPRINT]))
        except (KeyError, TypeError, ValueError):  # there is none
            prints[name] = {}
    labels = {
        name: (one.get(dims.TEXTURE), one.get(dims.SPEED)) for name, one in attributes.items()
    }
    return Notes(issues, find_copies(prints, labels), rest_sentences(attributes), of_force)


def warn(recordings: Sequence[Responses], progress: Progress) -> None:
    """Name what is wrong with recordings that are learnt from, and which seem to be copies."""
    for sentence in make_notes({str(r.attrs["name"]): r.attrs for r in recordings}).sentences:
        progress.note(sentence)


def warn_of_copies(copies: Sequence[Copy]) -> list[str]:
    """Return a sentence that warns of copies, or none."""
    if not copies:
        return []
    named = [f"{c.one} and {c.other} (by {c.kind}, {c.alike:.2f} alike)" for c in copies[:NAMED]]
    more = f", and {len(copies) - NAMED} more pairs" if len(copies) > NAMED else ""
    return [
        f"warning: these seem to be copies of one recording: {', '.join(named)}{more}; what is "
        "learnt from one is then tested on the other: look at the files, and take one of them out"
    ]

"""Warnings of recordings that are copies of others, encoded again under another name."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.core import dims
from afferents.core.fingerprint import Fingerprint, find_copies, fingerprint, read, written
from afferents.core.progress import Progress
from afferents.core.responses import Responses, doubts_in
from afferents.core.store import store_config, stored_attributes

FINGERPRINT = "fingerprint"
"""Attribute of a recording's responses that holds its fingerprint."""
NAMED = 3
"""So many pairs are named in a warning."""


@dataclass(frozen=True)
class Likeness:
    """Two recordings that seem to be one, and by which fingerprint."""

    one: str
    other: str
    kind: str
    alike: float


@dataclass(frozen=True)
class Notes:
    """What is to be said of a store: what was accepted, by recording, and copies."""

    accepted: dict[str, list[str]]
    copies: list[Likeness]

    @property
    def sentences(self) -> list[str]:
        """Say it, a line a recording that was accepted."""
        kept = [
            f"{name}: kept as it is, though wrong: {doubt}"
            for name, doubts in self.accepted.items()
            for doubt in doubts
        ]
        return [*kept, *warning_of(self.copies)]


def with_fingerprint(responses: Responses) -> Responses:
    """Return responses with the recording's fingerprint in their attributes."""
    return responses.assign_attrs({FINGERPRINT: json.dumps(written(fingerprint(responses)))})


def notes_of(store: Path) -> Notes:
    """Return what is to be said of the recordings in a store."""
    attributes = stored_attributes(store, store_config(store).get("recordings", []))
    accepted = {name: doubts for name, one in attributes.items() if (doubts := doubts_in(one))}
    found = {name: _stored(one) or {} for name, one in attributes.items()}
    return Notes(accepted, _copies(found, attributes))


def copies_among(recordings: Sequence[Responses]) -> list[Likeness]:
    """Return which recordings seem to be copies; what holds no fingerprint is given one."""
    attributes = {str(r.attrs["name"]): r.attrs for r in recordings}
    found = {str(r.attrs["name"]): _fingerprint_of(r) for r in recordings}
    return _copies(found, attributes)


def warn_of_copies(recordings: Sequence[Responses], progress: Progress) -> None:
    """Say which recordings seem to be copies."""
    for sentence in warning_of(copies_among(recordings)):
        progress.note(sentence)


def warning_of(copies: Sequence[Likeness]) -> list[str]:
    """Return a sentence that warns of copies, or none."""
    if not copies:
        return []
    named = [f"{c.one} and {c.other} (by {c.kind}, {c.alike:.2f} alike)" for c in copies[:NAMED]]
    more = f", and {len(copies) - NAMED} more pairs" if len(copies) > NAMED else ""
    return [
        f"warning: these seem to be copies of one recording: {', '.join(named)}{more}; what is "
        "learnt from one is then tested on the other: look at the files, and take one of them out"
    ]


def _fingerprint_of(responses: Responses) -> Fingerprint:
    stored = _stored(responses.attrs)
    return fingerprint(responses) if stored is None else stored


def _stored(attributes: Mapping[str, Any]) -> Fingerprint | None:
    """Return the fingerprint in a recording's attributes; None if none can be read."""
    try:
        return read(json.loads(attributes[FINGERPRINT]))
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _copies(
    found: Mapping[str, Fingerprint], attributes: Mapping[str, Mapping[str, Any]]
) -> list[Likeness]:
    names = list(found)
    labels = [(str(attributes[n][dims.TEXTURE]), float(attributes[n][dims.SPEED])) for n in names]
    copies = find_copies([found[name] for name in names], labels)
    return [Likeness(names[c.one], names[c.other], c.kind, c.alike) for c in copies]

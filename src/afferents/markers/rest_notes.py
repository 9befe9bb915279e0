"""What a rest frame showed that is to be said: blobs too many or too few, and whose place it took.

It stands in the attributes of a recording's tracks, and so in those of its responses.
"""

from collections.abc import Mapping
from typing import Any

from afferents.markers.rest import AtRest, RestMarkers

BLOBS, MARKERS, REPLACED = "rest_blobs", "rest_markers", "rest_replaced"
NAMED = 3
"""So many recordings are named in a sentence."""


def rest_seen(at_rest: AtRest, rest: RestMarkers) -> dict[str, int]:
    """Return, as attributes, how many blobs and markers there were, and how many are missing.

    `rest_replaced` counts markers that were not found, and stand where the others (or, under
    ``published``, the reference) say that they should.
    """
    return {
        BLOBS: len(at_rest.found),
        MARKERS: len(rest.position),
        REPLACED: int((~rest.present).sum()),
    }


def rest_sentences(attributes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say of recordings, by the attributes of their tracks, what was amiss in their rest frames.

    Nothing is said of those in which every blob was one marker.
    """
    known = {name: one for name, one in attributes.items() if BLOBS in one}
    published = {name: one for name, one in known.items() if one.get("method") == "published"}
    others = {name: one for name, one in known.items() if name not in published}
    return [
        *_said(
            {n: f"{o[BLOBS]} blobs" for n, o in published.items() if o[BLOBS] != o[MARKERS]},
            "the rest frame shows another number of blobs than markers; each marker took the "
            "nearest, as the published code does",
        ),
        *_said(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in published.items() if o[REPLACED]},
            "markers farther from the reference clip's than the gate were put where those are, as "
            "the published code does; their SA-I counts from where they are not (the other "
            "trackers don't do so)",
        ),
        *_said(
            {n: f"{o[BLOBS]} for {o[MARKERS]}" for n, o in others.items() if o[BLOBS] > o[MARKERS]},
            "the rest frame shows blobs that the sensor's layout has no place for; they were left "
            "out",
        ),
        *_said(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in others.items() if o[REPLACED]},
            "the rest frame lacks markers, which count as lost until they are seen",
        ),
    ]


def _said(found: Mapping[str, str], what: str) -> list[str]:
    """Say something of the recordings that it is true of, or nothing."""
    if not found:
        return []
    named = ", ".join(f"{name} ({how})" for name, how in list(found.items())[:NAMED])
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    many = f"{len(found)} recording{'s' if len(found) > 1 else ''}"
    return [f"{many}, {named}{more}: {what}."]

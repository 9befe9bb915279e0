"""What a rest frame showed: blobs too many or too few, and whose place it took.

It stands in the attributes of a recording's tracks, and so in those of its responses.
"""

from collections.abc import Mapping
from typing import Any

from afferents.markers.rest import AtRest, RestMarkers

BLOBS, MARKERS, REPLACED = "rest_blobs", "rest_markers", "rest_replaced"
STALE, BITS = "rest_stale", "bits"
NAMED = 3
"""This many recordings are named in a sentence."""


def rest_seen(at_rest: AtRest, rest: RestMarkers) -> dict[str, int]:
    """Return, as attributes, how many blobs and markers there were, and how many are missing.

    `rest_replaced` counts markers that were not found, and stand where the others (or, under
    ``published``, the reference) say that they should.
    """
    return {
        BLOBS: len(at_rest.position),
        MARKERS: len(rest.position),
        REPLACED: int((~rest.present).sum()),
    }


def start_sentences(attributes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say of recordings, by their attributes, which start with stale frames or have more bits."""
    return [
        *_name_recordings(
            {name: f"{one[STALE]} frames" for name, one in attributes.items() if one.get(STALE)},
            "the picture jumps in the first frames and then stands still, as where a camera's "
            "buffer gives frames of an earlier run; rest is the frame after these",
        ),
        *_name_recordings(
            {
                name: f"{one[BITS]} bits"
                for name, one in attributes.items()
                if 8 < one.get(BITS, 8) < 16
            },
            "no pixel of its 16-bit images uses more, so this counts as the camera's depth",
        ),
    ]


def rest_sentences(attributes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say of recordings, by the attributes of their tracks, what was amiss in their rest frames.

    There is nothing on those in which every blob was one marker.
    """
    known = {name: one for name, one in attributes.items() if BLOBS in one}
    published = {name: one for name, one in known.items() if one.get("method") == "published"}
    others = {name: one for name, one in known.items() if name not in published}
    return [
        *start_sentences(known),
        *_name_recordings(
            {n: f"{o[BLOBS]} blobs" for n, o in published.items() if o[BLOBS] != o[MARKERS]},
            "the rest frame shows another number of blobs than markers; each marker took the "
            "nearest, as the published code does",
        ),
        *_name_recordings(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in published.items() if o[REPLACED]},
            "markers farther from the reference clip's than the gate were put where those are, as "
            "the published code does; their SA-I counts from where they are not (the other "
            "trackers don't do so)",
        ),
        *_name_recordings(
            {n: f"{o[BLOBS]} for {o[MARKERS]}" for n, o in others.items() if o[BLOBS] > o[MARKERS]},
            "the rest frame shows blobs that the sensor's layout has no place for; they were left "
            "out",
        ),
        *_name_recordings(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in others.items() if o[REPLACED]},
            "the rest frame lacks markers, which count as lost until they are seen",
        ),
    ]


def _name_recordings(found: Mapping[str, str], what: str) -> list[str]:
    """Say something of the recordings that it is true of, or nothing."""
    if not found:
        return []
    named = ", ".join(f"{name} ({how})" for name, how in list(found.items())[:NAMED])
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    many = f"{len(found)} recording{'s' if len(found) > 1 else ''}"
    return [f"{many}, {named}{more}: {what}."]

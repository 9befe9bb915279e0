"""Responses of one recording: the labelled data set that extraction writes and encodings read.

========================  ====================  ===========  ==================================
variable                  dims                  unit         meaning
========================  ====================  ===========  ==================================
`position`                time, marker, space   px           marker positions, NaN where lost
`detected`                time, marker          bool         False where the marker was lost
`rest_position`           marker, space         px           positions in the rest frame
`sa1`                     time, marker          px           SA-I (Eq. 1)
`ra1`                     time, marker          px/frame     RA-I (Eq. 2), first frame NaN
`ra2`                     audio_time, channel   (as read)    RA-II / vibration
========================  ====================  ===========  ==================================

A recording without video has only `ra2`, one without audio none. Coordinates: `time` (s),
`space` (x, y), and on `marker` its place in the sensor's layout, `row` and `column`, where the
layout is a grid. `audio_time` carries no coordinate (it would be larger than the data): sample
n lies at n / `ra2.attrs["sample_rate_hz"]` s.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from afferents.core import dims
from afferents.core.doubt import Doubt
from afferents.core.errors import InputError
from afferents.core.recording import Recording, natural_order

Responses = xr.Dataset
"""A data set of the form above."""

ACCEPTED = "accepted"
"""Attribute, and condition, of what is wrong with a recording and was accepted."""

_DIMS: dict[str, tuple[str, ...]] = {
    dims.POSITION: (dims.TIME, dims.MARKER, dims.SPACE),
    dims.DETECTED: (dims.TIME, dims.MARKER),
    dims.REST_POSITION: (dims.MARKER, dims.SPACE),
    dims.SA1: (dims.TIME, dims.MARKER),
    dims.RA1: (dims.TIME, dims.MARKER),
    dims.RA2: (dims.AUDIO_TIME, dims.CHANNEL),
}


def label(responses: Responses, recording: Recording) -> Responses:
    """Return `responses` with the recording's name, texture, speed and source in the attrs."""
    steady = list(recording.steady_s) if recording.steady_s else None
    return responses.assign_attrs(
        {
            "name": recording.name,
            dims.TEXTURE: recording.texture,
            dims.SPEED: float(recording.speed_mm_s),
            "source": str(recording.source.name),
            "steady_s": json.dumps(steady),
            "conditions": json.dumps(dict(recording.conditions)),
        }
    )


def steady_s(responses: Responses) -> tuple[float, float] | None:
    """Return start and end of constant speed in s, or None where the source did not say."""
    steady = json.loads(responses.attrs.get("steady_s", "null"))
    return (float(steady[0]), float(steady[1])) if steady else None


def conditions(responses: Responses) -> dict[str, str | float]:
    """Return whatever else the source declared: pressure, direction, repetition."""
    declared: dict[str, str | float] = json.loads(responses.attrs.get("conditions", "{}"))
    return declared


def with_doubts(responses: Responses, doubts: Sequence[Doubt]) -> Responses:
    """Return `responses` with what is wrong with the recording and was accepted.

    The kinds are the condition `accepted`, by which the recording can be left out; the attribute
    `accepted` says it in sentences.
    """
    if not doubts:
        return responses
    kinds = " ".join(sorted({doubt.kind for doubt in doubts}))
    return responses.assign_attrs(
        conditions=json.dumps({**conditions(responses), ACCEPTED: kinds}),
        **{ACCEPTED: json.dumps([str(doubt) for doubt in doubts])},
    )


def doubts_in(attributes: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with a recording and was accepted, by its attributes."""
    said: list[str] = json.loads(attributes.get(ACCEPTED, "[]"))
    return said


def textures_of(recordings: Iterable[Responses]) -> list[str]:
    """Return the textures that recordings are of, each once, in their natural order."""
    return sorted({str(r.attrs[dims.TEXTURE]) for r in recordings}, key=natural_order)


def speeds_of(recordings: Iterable[Responses]) -> list[float]:
    """Return the speeds that recordings are of, mm/s, each once, slowest first."""
    return sorted({float(r.attrs[dims.SPEED]) for r in recordings})


def check_responses(responses: Responses, where: Path | str) -> Responses:
    """Return `responses` unchanged if variables, dims and labels are as documented above.

    Raises
    ------
    InputError
        Naming the first variable, dim or attribute that is missing or wrong.
    """
    known = [name for name in _DIMS if name in responses]
    if not known:
        raise InputError(where, f"one of {', '.join(_DIMS)}", f"{list(responses) or 'nothing'}")
    for name in known:
        if responses[name].dims != _DIMS[name]:
            raise InputError(where, f"{name} {_DIMS[name]}", f"{name} {responses[name].dims}")
    for attribute in ("name", dims.TEXTURE, dims.SPEED):
        if attribute not in responses.attrs:
            raise InputError(where, f"the attribute '{attribute}'", "none")
    if dims.RA2 in responses and dims.SAMPLE_RATE not in responses[dims.RA2].attrs:
        raise InputError(where, f"ra2 with the attribute '{dims.SAMPLE_RATE}'", "none")
    return responses

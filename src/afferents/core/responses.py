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
from collections.abc import Iterable
from pathlib import Path

import xarray as xr
from pydantic import BaseModel

from afferents.core import dims
from afferents.core.documents import as_form, parse_json
from afferents.core.errors import InputError
from afferents.core.recording import Recording, natural_order

Responses = xr.Dataset
"""A data set of the form above."""

_AGAIN = "extract again"
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
    return _declared(responses).steady_s


def conditions(responses: Responses) -> dict[str, str | float]:
    """Return whatever else the source declared: pressure, direction, repetition."""
    return {**_declared(responses).conditions}


class _Declared(BaseModel):
    """What a source declared, which stands in the attributes as JSON."""

    steady_s: tuple[float, float] | None = None
    conditions: dict[str, str | int | float] = {}


def _declared(responses: Responses) -> _Declared:
    where, what = responses.attrs.get("name", "a recording"), "what 'afferents extract' declares"
    there = {name: responses.attrs[name] for name in ("steady_s", "conditions")
             if name in responses.attrs}  # fmt: skip
    content = {name: parse_json(text, where, what, _AGAIN) for name, text in there.items()}
    return as_form(content, _Declared, where, what, _AGAIN)


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

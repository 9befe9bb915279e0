"""Responses of one recording: the labelled data set, its checks, and reading a variable whole.

Extraction writes it, and encodings read it.

========================  ====================  ===========  ==================================
variable                  dims                  unit         meaning
========================  ====================  ===========  ==================================
`position`                time, marker, space   px           marker positions, NaN where lost
`detected`                time, marker          bool         False where the marker was lost
`rest_position`           marker, space         px           positions in the rest frame
`sa1`                     time, marker          px           SA-I (Eq. 1)
`ra1`                     time, marker          px/frame     RA-I (Eq. 2), first frame NaN
`ra2`                     audio_time, channel   (as read)    RA-II / vibration
`drum_position`           drive_time            mm           the drum's way; only where logged
`speed`                   speed_time            mm/s         where it changes; see `store.motion`
`force`, `pose`, ...      force_time, ...       (as stated)  what else was logged meanwhile
========================  ====================  ===========  ==================================

Of a fingertip without markers, a cell of the picture stands for a marker: `position` is its middle
and never moves, `sa1` is in grey levels, `ra1` in grey levels/frame.

A recording without video has only `ra2`, one without audio none. Coordinates: `time` (s),
`space` (x, y), and on `marker` its place in the tactile image, `row` and `column`: integers where
the layout is a square grid, floating on other layouts that a sensor file describes. `audio_time`
carries no coordinate (it would be larger than the data): sample n lies at
n / `ra2.attrs["sample_rate_hz"]` s.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Json, field_validator

from afferents import dims, documents
from afferents.errors import InputError, reading
from afferents.quality.issues import QualityIssue
from afferents.store.integrity import require_values
from afferents.store.recording import Recording, natural_order

Responses = xr.Dataset
"""A data set of the form above."""

_AGAIN = "extract again"
ISSUES = "issues"
"""Attribute, and condition, of what is wrong with a recording that was kept."""

_DIMS: dict[str, tuple[str, ...]] = {
    dims.POSITION: (dims.TIME, dims.MARKER, dims.SPACE),
    dims.DETECTED: (dims.TIME, dims.MARKER),
    dims.REST_POSITION: (dims.MARKER, dims.SPACE),
    dims.SA1: (dims.TIME, dims.MARKER),
    dims.RA1: (dims.TIME, dims.MARKER),
    dims.RA2: (dims.AUDIO_TIME, dims.CHANNEL),
}


VARIABLES = frozenset({*_DIMS, dims.DRUM_POSITION, dims.FRAME_CHANGE})
"""Names that nothing else may have."""
_BESIDE = {dims.DRUM_POSITION: (dims.DRIVE_TIME,), dims.SPEED_SERIES: (dims.SPEED_TIME,)}
"""What may stand next to these, and is no response."""
_ATTRIBUTES = "the attributes of a recording"
_LEAST_HZ, _MOST_HZ = 1.0, 1e7
"""Between these lies the rate of any vibration channel."""
_LOUDEST = 1e18
"""Its square, summed over a window, still is a number in float32."""
_MOST_PIXELS = 200
"""A side of the tactile images of a layout that is not square."""
_FARTHEST_PX = 1e5
"""No camera's image is so large."""


def _interval(steady: tuple[float, float]) -> tuple[float, float]:
    if not 0 <= steady[0] < steady[1] < np.inf:
        raise ValueError("steady_s is [start, stop] with 0 <= start < stop, both finite")
    return steady


Steady = Annotated[tuple[float, float], AfterValidator(_interval)]
"""Start and stop of constant speed, s."""


class _Declared(BaseModel):
    """What a source declared of a recording, in its attributes, in part as JSON."""

    model_config = ConfigDict(extra="allow")

    steady_s: Json[Steady | None] = None
    conditions: Json[dict[str, str | float | int | bool]] = Field(default_factory=dict)
    rest_frame: int = Field(0, ge=0)


class _Attributes(_Declared):
    """What the attributes of a recording must be; others may stand next to them."""

    name: str = Field(min_length=1)
    texture: str = Field(min_length=1)
    speed_mm_s: float

    @field_validator("speed_mm_s")
    @classmethod
    def _is_a_speed(cls, speed: float) -> object:
        if not (np.isnan(speed) or 0 < speed < np.inf):
            raise ValueError("greater than 0, or NaN where it is not known")
        return speed


def label(responses: Responses, recording: Recording) -> Responses:
    """Return `responses` with the recording's name, texture, speed and source in the attrs."""
    steady = list(recording.steady_s) if recording.steady_s else None
    return responses.assign_attrs(
        {
            "name": recording.name,
            "source": str(recording.source.name),
            "steady_s": json.dumps(steady),
            **labels_of(recording),
        }
    )


def labels_of(recording: Recording) -> dict[str, Any]:
    """Return the attributes that say what was recorded: texture, speed and conditions."""
    return {
        dims.TEXTURE: recording.texture,
        dims.SPEED: np.nan if recording.speed_mm_s is None else float(recording.speed_mm_s),
        "conditions": json.dumps(dict(recording.conditions)),
        dims.NAMED_BY_SPACING: recording.named_by_spacing,
    }


def named_by_spacing(recordings: Sequence[Responses]) -> dict[str, bool]:
    """Return that textures are named by their bump spacing, for a summary; nothing of others."""
    named = all(r.attrs.get(dims.NAMED_BY_SPACING, False) for r in recordings)
    return {dims.NAMED_BY_SPACING: True} if named else {}


def steady_s(responses: Responses) -> tuple[float, float] | None:
    """Return start and end of constant speed in s, or None where the source did not say."""
    return _declared(responses).steady_s


def conditions(responses: Responses) -> dict[str, str | float]:
    """Return whatever else the source declared: pressure, direction, repetition."""
    return {**_declared(responses).conditions}


def _declared(responses: Responses) -> _Declared:
    where = responses.attrs.get("name", "a recording")
    return documents.as_form(_plain(responses), _Declared, where, _ATTRIBUTES, _AGAIN)


def _plain(responses: Responses) -> dict[str, Any]:
    """Return the attributes as a store holds them."""
    return {
        str(name): value.tolist() if isinstance(value, np.generic | np.ndarray) else value
        for name, value in responses.attrs.items()
    }


def add_issues(responses: Responses, issues: Sequence[QualityIssue]) -> Responses:
    """Return `responses` with what is wrong with the recording, though it is kept.

    The kinds are the condition `issues`, by which the recording can be left out; the attribute
    `issues` holds a sentence for each.
    """
    if not issues:
        return responses
    kinds = " ".join(sorted({issue.kind for issue in issues}))
    return responses.assign_attrs(
        conditions=json.dumps({**conditions(responses), ISSUES: kinds}),
        **{ISSUES: json.dumps([str(issue) for issue in issues])},
    )


def issues_in(attributes: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with a recording, by its attributes."""
    issues: list[str] = json.loads(attributes.get(ISSUES, "[]"))
    return issues


def textures_of(recordings: Iterable[Responses]) -> list[str]:
    """Return the textures that recordings are of, each once, in their natural order."""
    return sorted({str(r.attrs[dims.TEXTURE]) for r in recordings}, key=natural_order)


def speed_of(responses: Responses) -> float | None:
    """Return the speed of a recording, mm/s; None where it is not known."""
    speed = float(responses.attrs[dims.SPEED])
    return None if np.isnan(speed) else speed


def list_speeds(recordings: Iterable[Responses]) -> list[float]:
    """Return the speeds that are known of recordings, mm/s, each once, slowest first."""
    return sorted({speed for r in recordings if (speed := speed_of(r)) is not None})


def check_responses(responses: Responses, where: Path | str) -> Responses:
    """Return `responses` unchanged if variables, dims and labels are as documented above.

    Raises
    ------
    InputError
        Naming the first variable, dim or attribute that is missing or wrong.
    """
    known = [name for name in _DIMS if name in responses]
    if not known:
        raise InputError(
            f"{where}: expected one of {', '.join(_DIMS)}, found {list(responses) or 'nothing'}"
        )
    for name, its in {**_DIMS, **_BESIDE}.items():
        if name in responses and responses[name].dims != its:
            raise InputError(f"{where}: expected {name} {its}, found {name} {responses[name].dims}")
    for attribute in ("name", dims.TEXTURE, dims.SPEED):
        if attribute not in responses.attrs:
            raise InputError(f"{where}: expected the attribute '{attribute}', found none")
    documents.as_form(_plain(responses), _Attributes, where, _ATTRIBUTES, _AGAIN)
    _check_clocks(responses, where)
    _check_layout(responses, where)
    return responses


def check_values(response: xr.DataArray, where: str) -> xr.DataArray:
    """Return a variable, read whole, unchanged if its values are as extracted, and possible.

    Raises
    ------
    InputError
        If they have changed since, are infinite, or lie where nothing can be; NaN is a marker that
        was lost, and may be anywhere but in sound.
    """
    require_values(response, where)
    values = response.values
    if values.dtype.kind != "f" or not values.size:
        return response
    if response.name == dims.RA2:
        sound = np.abs(values) < _LOUDEST  # False for NaN
        if not sound.all():
            n = int(np.argmin(sound.all(axis=1)))
            at_s = n / float(response.attrs[dims.SAMPLE_RATE])
            found = f"{values[n][~sound[n]][0]:.3g} at sample {n} ({at_s:.3f} s)"
            raise InputError(f"{where}: expected samples that are numbers, found {found}; {_AGAIN}")
        return response
    largest = float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))  # NaN passed over
    if not largest < np.inf:
        raise InputError(
            f"{where}: expected values that are numbers, found infinite ones; {_AGAIN}"
        )
    if response.name == dims.POSITION and not 0 < largest < _FARTHEST_PX:
        expected = f"places within {_FARTHEST_PX:g} px, not all at 0"
        raise InputError(f"{where}: expected {expected}, found up to {largest:g}; {_AGAIN}")
    return response


def _check_clocks(responses: Responses, where: Path | str) -> None:
    """Refuse times that don't go on, and rates that no vibration has."""
    for clock in map(str, responses.coords):
        what = "frame" if clock == dims.TIME else clock.removesuffix("_time")
        time_s = responses[clock].values
        finite = time_s.dtype.kind == "f" and np.isfinite(time_s).all()
        if what != clock and not (finite and (np.diff(time_s) > 0).all()):
            raise InputError(
                f"{where}: expected {what} times in s, each after the one before, found others"
            )
    if dims.RA2 in responses:
        rate = responses[dims.RA2].attrs.get(dims.SAMPLE_RATE)
        if rate is None:
            raise InputError(
                f"{where}: expected ra2 with the attribute '{dims.SAMPLE_RATE}', found none"
            )
        if not (isinstance(rate, int | float) and _LEAST_HZ <= rate <= _MOST_HZ):
            expected = f"a {dims.SAMPLE_RATE} from {_LEAST_HZ:g} to {_MOST_HZ:g} Hz"
            raise InputError(f"{where}: expected {expected}, found {rate!r}; {_AGAIN}")


def _check_layout(responses: Responses, where: Path | str) -> None:
    """Refuse rows and columns that are no places in an image."""
    if dims.ROW not in responses.coords:
        return
    places = np.stack([responses[name].values for name in (dims.ROW, dims.COLUMN)])
    n = places.shape[1]
    first, last = (0, max(n, 1)) if places.dtype.kind in "iu" else (-1, _MOST_PIXELS)
    if places.dtype.kind not in "iuf" or not ((places >= first) & (places < last)).all():
        raise InputError(f"{where}: expected rows and columns from 0 to {n - 1}, found others")
    if len(np.unique(places, axis=1).T) < n:
        raise InputError(
            f"{where}: expected a row and column for each marker, found two markers at one"
        )


def read_whole(responses: Responses, variable: str) -> xr.DataArray:
    """Read a response into memory, with its own attributes and the recording's.

    Raises
    ------
    InputError
        If it can't be read, has changed since it was extracted, or holds what can't be.
    """
    where = f"{variable} of {responses.attrs['name']}"
    kinds = (OSError, ValueError, RuntimeError, ArithmeticError)
    do = "remove the recording's folder and extract again"
    with reading(where, "data that can be read", *kinds, do=do):
        # Not `load`, which would keep what was read in the responses.
        response = check_values(responses[variable].compute(), where)
    return labelled(response, responses)


def labelled(response: xr.DataArray, responses: Responses) -> xr.DataArray:
    """Return a response with its own attributes and those of its recording."""
    return response.assign_attrs({**response.attrs, **responses.attrs})

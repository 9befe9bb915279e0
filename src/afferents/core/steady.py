"""The part of recordings at constant speed, where somebody says it anew: `--steady 0.2:2.8`."""

import json
from collections.abc import Iterable, Sequence

import numpy as np

from afferents.core import dims
from afferents.core.cut import Cut
from afferents.core.errors import InputError
from afferents.core.responses import Responses

OPTION = "--steady"
_EXPECTED = "START:STOP in s, as in 0.2:2.8"

Steady = tuple[float, float]
"""Start and end of constant speed, s."""


def parse_steady(text: str | None) -> Steady | None:
    """Read a steady part as typed: ``0.2:2.8``; None for none.

    Raises
    ------
    InputError
        If it is none.
    """
    if text is None:
        return None
    try:
        start, stop = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(OPTION, _EXPECTED, f"'{text}'") from None
    return start, stop


def steady_in(wanted: Sequence[float] | None, cut: Cut) -> Steady | None:
    """Return a steady part, s, as it is given to a command.

    Raises
    ------
    InputError
        If it is reversed, or no two times, or the cut has no use for it.
    """
    if wanted is None:
        return None
    try:
        start, stop = (float(time_s) for time_s in wanted)
    except (TypeError, ValueError):
        raise InputError(OPTION, "start and stop in s", f"{wanted!r}") from None
    if not 0 <= start < stop < np.inf:
        expected = f"{_EXPECTED}: 0 or more, and the stop after the start"
        raise InputError(OPTION, expected, written((start, stop)))
    if cut == "published":
        do = "leave one out: the published cut counts frames"
        raise InputError(OPTION, "the cut 'all'", "'published'", do)
    return start, stop


def written(steady: Sequence[float]) -> str:
    """Return a steady part as the option takes it."""
    return f"{steady[0]:g}:{steady[1]:g}"


def with_steady(recordings: Iterable[Responses], steady: Steady | None) -> list[Responses]:
    """Return recordings whose steady part is this; as they are for None."""
    if steady is None:
        return list(recordings)
    return [r.assign_attrs(steady_s=json.dumps(list(steady))) for r in recordings]


def require_within(responses: Responses, variable: str, steady: Steady | None) -> None:
    """Refuse a steady part that a recording does not reach to.

    Parameters
    ----------
    variable
        What is used of the recording: video and audio may be of different lengths.

    Raises
    ------
    InputError
        Naming the recording, and from when to when it is.
    """
    if steady is None:
        return
    begin, end, step = _extent_s(responses, variable)
    if steady[0] < begin - step or steady[1] > end + step:
        raise InputError(
            OPTION,
            f"a part of every recording, as {responses.attrs['name']}, "
            f"whose {variable} is from {begin:.2f} to {end:.2f} s",
            written(steady),
        )


def _extent_s(responses: Responses, variable: str) -> tuple[float, float, float]:
    """Return when a variable begins and ends, and the time between two of its values, s."""
    response = responses[variable]
    if dims.AUDIO_TIME in response.dims:
        rate = float(response.attrs[dims.SAMPLE_RATE])
        return 0.0, response.sizes[dims.AUDIO_TIME] / rate, 1 / rate
    time_s = responses[dims.TIME].values
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    return float(time_s[0]), float(time_s[-1]) + step, step

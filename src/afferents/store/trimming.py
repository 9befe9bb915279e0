"""Which part of a recording is used: a cut, or the part at constant speed that `--steady` gives."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents import choices, dims
from afferents.errors import InputError, then
from afferents.quality.lasting import EDGE_S
from afferents.store.responses import Responses

FIRST_FRAME, LAST_FRAME = 510, 5510
"""Cut `published`: video frames 510 to 5509 (spatial/process_static.ipynb, cell 4)."""
AUDIO_S = 60.0
"""Cut `published`: the last 60 s of audio (vibrotactile/process_vibration.ipynb, cell 3)."""


def cut_frames(
    time_s: NDArray[np.float64], cut: choices.Cut, steady_s: tuple[float, float] | None, name: str
) -> slice:
    """Return the frames of a recording that the cut keeps.

    Parameters
    ----------
    time_s
        Presentation times, shape (n_frames,), s.
    cut
        `published`, or `all`: from constant speed on, `steady_s` if known, else without the
        first and last 2.5 s.
    name
        The recording, for the error.

    Raises
    ------
    InputError
        If the recording is too short for the cut.
    """
    if cut == "published":
        if len(time_s) < LAST_FRAME:
            raise InputError(
                f"{name}: expected at least {LAST_FRAME} video frames for the cut 'published', "
                f"found {len(time_s)}; the cut 'all' takes shorter ones"
            )
        return slice(FIRST_FRAME, LAST_FRAME)
    begin_s, end_s = (float(time_s[0]), float(time_s[-1])) if len(time_s) else (0.0, 0.0)
    start, stop = steady_s or (begin_s + EDGE_S, end_s - EDGE_S)
    first, last = np.searchsorted(time_s, [start, stop])
    if last <= first:
        raise _nothing_left(name, "video", begin_s, end_s, steady_s)
    return slice(int(first), int(last))


def cut_audio(
    n_samples: int,
    sample_rate_hz: float,
    cut: choices.Cut,
    steady_s: tuple[float, float] | None,
    name: str,
) -> slice:
    """Return the audio samples of a recording that the cut keeps; see `cut_frames`."""
    length_s = n_samples / sample_rate_hz
    if cut == "published":
        kept = round(AUDIO_S * sample_rate_hz)
        if n_samples < kept:
            raise InputError(
                f"{name}: expected at least {AUDIO_S:g} s of audio for the cut 'published', found "
                f"{length_s:.2f} s; the cut 'all' takes shorter ones"
            )
        return slice(n_samples - kept, n_samples)
    start, stop = steady_s or (EDGE_S, length_s - EDGE_S)
    first, last = round(start * sample_rate_hz), min(round(stop * sample_rate_hz), n_samples)
    if last <= first:
        raise _nothing_left(name, "audio", 0.0, length_s, steady_s)
    return slice(first, last)


def _nothing_left(
    name: str, kind: str, begin_s: float, end_s: float, steady_s: tuple[float, float] | None
) -> InputError:
    found = f"{kind} from {begin_s:.2f} to {end_s:.2f} s"
    if steady_s is None:
        return InputError(
            f"{name}: expected more than {2 * EDGE_S:g} s, since {EDGE_S:g} s go at each end "
            f"where nothing says when the speed was constant, found {found}; say it: steady_s = "
            "[START, STOP] in session.toml or dataset.toml, or --steady START:STOP"
        )
    declared = f"{steady_s[0]:g} to {steady_s[1]:g} s"
    return InputError(
        f"{name}: expected {kind} within the declared constant speed, {declared}, found {found}"
    )


OPTION = "--steady"
_EXPECTED = "START:STOP in s, as in 0.2:2.8"

Steady = tuple[float, float]
"""Start and end of constant speed, s."""


def parse_steady(wanted: str | Sequence[float] | None, cut: choices.Cut) -> Steady | None:
    """Return a steady part, s, as it is given to a command: ``0.2:2.8``, or two times.

    Raises
    ------
    InputError
        If it is reversed, or no two times, or the cut has no use for it.
    """
    if wanted is None:
        return None
    parts = wanted.split(":") if isinstance(wanted, str) else wanted
    try:
        start, stop = map(float, parts)
    except (TypeError, ValueError):
        raise InputError(f"{OPTION}: expected {_EXPECTED}, found {wanted!r}") from None
    if not 0 <= start < stop < np.inf:
        expected = f"{_EXPECTED}: 0 or more, and the stop after the start"
        raise InputError(f"{OPTION}: expected {expected}, found {written((start, stop))}")
    if cut == "published":
        do = "leave one out: the published cut counts frames"
        raise InputError(f"{OPTION}: expected the cut 'all', found 'published'{then(do)}")
    return start, stop


def written(steady: Sequence[float]) -> str:
    """Return a steady part as the option takes it."""
    return f"{steady[0]:g}:{steady[1]:g}"


def set_steady(recordings: Iterable[Responses], steady: Steady | None) -> list[Responses]:
    """Return recordings whose steady part is this; as they are for None."""
    if steady is None:
        return list(recordings)
    return [r.assign_attrs(steady_s=json.dumps(list(steady))) for r in recordings]


PAST_END_S = 0.5
"""So far a declared part may reach past the end: clips lack a frame or a tenth of a second."""


def require_reached(path: Path, length_s: float, steady_s: Steady, do: str) -> None:
    """Refuse a file that ends, by more than clips lack, before the declared constant speed does.

    Raises
    ------
    InputError
        Naming the file; `do` is what to do.
    """
    if length_s < steady_s[1] - PAST_END_S:
        raise InputError(
            f"{path}: expected at least {steady_s[1]:g} s, to the end of steady_s, found "
            f"{length_s:.2f} s; {do}"
        )


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
    response = responses[variable]
    if dims.AUDIO_TIME in response.dims:
        rate = float(response.attrs[dims.SAMPLE_RATE])
        begin, end, step = 0.0, response.sizes[dims.AUDIO_TIME] / rate, 1 / rate
    else:
        time_s = responses[dims.TIME].values
        step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
        begin, end = float(time_s[0]), float(time_s[-1]) + step
    if steady[0] < begin - step or steady[1] > end + step:
        raise InputError(
            f"{OPTION}: expected a part of every recording, as {responses.attrs['name']}, whose "
            f"{variable} is from {begin:.2f} to {end:.2f} s, found {written(steady)}"
        )

"""Which part of a recording is used: `published` or `all`. A choice apart from the protocol."""

import numpy as np
from numpy.typing import NDArray

from afferents.core.choices import Cut as Cut
from afferents.core.errors import InputError
from afferents.core.recording import EDGE_S

FIRST_FRAME, LAST_FRAME = 510, 5510
"""Cut `published`: video frames 510 to 5509 (spatial/process_static.ipynb, cell 4)."""
AUDIO_S = 60.0
"""Cut `published`: the last 60 s of audio (vibrotactile/process_vibration.ipynb, cell 3)."""


def cut_frames(
    time_s: NDArray[np.float64], cut: Cut, steady_s: tuple[float, float] | None, name: str
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
                name,
                f"at least {LAST_FRAME} video frames for the cut 'published'",
                f"{len(time_s)}",
                "the cut 'all' takes shorter ones",
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
    cut: Cut,
    steady_s: tuple[float, float] | None,
    name: str,
) -> slice:
    """Return the audio samples of a recording that the cut keeps; see `cut_frames`."""
    length_s = n_samples / sample_rate_hz
    if cut == "published":
        kept = round(AUDIO_S * sample_rate_hz)
        if n_samples < kept:
            raise InputError(
                name,
                f"at least {AUDIO_S:g} s of audio for the cut 'published'",
                f"{length_s:.2f} s",
                "the cut 'all' takes shorter ones",
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
            name,
            f"more than {2 * EDGE_S:g} s, since {EDGE_S:g} s go at each end where nothing says "
            "when the speed was constant",
            found,
            "say it: steady_s = [START, STOP] in session.toml, or --steady START:STOP",
        )
    declared = f"{steady_s[0]:g} to {steady_s[1]:g} s"
    return InputError(name, f"{kind} within the declared constant speed, {declared}", found)

"""Signals of a fingertip as JSON lines: a header, then a line a frame."""

import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from afferents import dims
from afferents.channels import PARTS
from afferents.choices import words_in
from afferents.errors import InputError
from afferents.files import require_free
from afferents.live.fingertip import Fingertip, Touch, stream

UNITS = {
    dims.POSITION: dims.PIXELS,
    dims.SA1: dims.PIXELS,
    dims.RA1: dims.PIXELS_PER_FRAME,
    "speed": dims.PIXELS_PER_SECOND,
    dims.SHEAR: dims.PIXELS,
    dims.RA2: "full scale",
}
"""Signals that can be asked for, and their units."""
DIGITS = 4
STDOUT = "-"


def signals_in(text: str | Sequence[str], has_sound: bool) -> list[str]:
    """Return the names of signals that a text asks for, separated by commas.

    Raises
    ------
    InputError
        If there is none of that name, or vibration is asked for without a source of sound.
    """
    names = list(dict.fromkeys(words_in(text)))
    unknown = [name for name in names if name not in UNITS]
    if unknown or not names:
        found = f"'{unknown[0]}'" if unknown else "none"
        raise InputError(f"--signals: expected of {', '.join(UNITS)}, found {found}")
    if dims.RA2 in names and not has_sound:
        raise InputError("--signals: expected a source of sound for ra2 (--audio), found none")
    return names


def lines_of(fingertip: Fingertip, names: Sequence[str]) -> Iterator[str]:
    """Yield a header, then a line for each frame, as JSON.

    The header says which sensor it is, where its markers are at rest, the units, and of a camera
    how far the Unix clock is ahead of the monotonic one, by which its frames are timed. A line has
    `time_s`, the share of markers that are `lost`, how many frames were `dropped` before it,
    whether something is `touching` the skin, the signals (null where a marker is lost, and RA-I
    after a gap), and `events` where something happened; rest that was set anew comes with it.

    Parameters
    ----------
    names
        Of the signals, see `UNITS`.
    """
    dropped = 0
    for n, touch in enumerate(fingertip):
        if n == 0:
            yield _as_json(_header(fingertip, touch, names))
        line: dict[str, Any] = {
            "time_s": round(touch.time_s, 6),
            "lost": round(touch.lost, DIGITS),
            "dropped": touch.quality.dropped - dropped,
            "touching": touch.touching,
        }
        if dims.RA2 in names:
            line["ra2_time_s"] = touch.ra2_time_s[:1].round(6).tolist()
        line |= {name: _rounded(getattr(touch, name)) for name in names}
        if touch.events:
            line |= {"events": touch.events, dims.REST_POSITION: _rounded(touch.now.rest)}
        dropped = touch.quality.dropped
        yield _as_json(line)


def _header(fingertip: Fingertip, touch: Touch, names: Sequence[str]) -> dict[str, Any]:
    sensor = fingertip.sensor
    return {
        "sensor": sensor.name,
        "layout": sensor.layout,
        "fps_hz": fingertip.fps_hz,
        "sample_rate_hz": fingertip.sample_rate_hz,
        "unix_ahead_s": time.time() - time.monotonic() if fingertip.is_live else None,
        "units": {name: UNITS[name] for name in names},
        "shear": list(PARTS),
        dims.REST_POSITION: _rounded(touch.now.rest),
    }


def _rounded(values: NDArray[np.floating]) -> list[Any]:
    rounded: list[Any] = np.round(values.astype(float), DIGITS).tolist()
    return rounded


def _as_json(line: dict[str, Any]) -> str:
    """Return a line of JSON, which has no NaN: null stands there."""
    return to_json(line, inf_nan_mode="null").decode()


def write_lines(lines: Iterator[str], to: str) -> None:
    """Write lines as they come to a file, or to standard output (``-``).

    Raises
    ------
    OSError
        If the disk is full; the file then ends with the last whole line.
    """
    if to == STDOUT:
        for line in lines:
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
        return
    with Path(to).open("xb", buffering=0) as file:
        for line in lines:
            whole = file.tell()
            try:
                rest = memoryview(line.encode() + b"\n")
                while rest:
                    rest = rest[file.write(rest) :]
            except OSError:
                file.truncate(whole)
                raise


def give_signals(
    signals: str,
    to: str,
    video: str | None,
    audio: str | None,
    sensor: str | None,
    audio_offset_s: float,
    speed: float,
    fps_hz: float | None,
    exposure_ms: float | None,
) -> None:
    """Run a fingertip, and write its signals; see `stream`, `lines_of` and `write_lines`."""
    if video is None:
        raise InputError("--video: expected a source, such as camera:0 or a video file, found none")
    names = signals_in(signals, audio is not None)
    if to != STDOUT:
        read = [Path(one.removeprefix("replay:")) for one in (video, audio) if one is not None]
        require_free(Path(to), reads=read)
    fingertip = stream(
        video, audio, sensor, audio_offset_s, speed, fps_hz=fps_hz, exposure_ms=exposure_ms
    )
    with fingertip:
        write_lines(lines_of(fingertip, names), to)

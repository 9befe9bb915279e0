"""How the clocks of recordings that are finished went: said by `inspect`."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from afferents.core.drum import ORIGIN
from afferents.core.errors import InputError, reason_of
from afferents.core.recording import Recording, Session
from afferents.pipeline.record.log import FRAMES, SOUND, BlockRow
from afferents.pipeline.record.sound_clock import LIMIT_FRAMES, SURE, SoundClock, sound_clock


class Clocks(NamedTuple):
    """Clocks of one recording.

    Attributes
    ----------
    name
        Of the recording.
    fps_hz
        Frames a second, by their numbers and times of capture; NaN where unknown.
    late_s
        By how much the sound began after the video's zero.
    sound
        When the sound was taken.
    seconds
        How long the sound is.
    """

    name: str
    fps_hz: float
    late_s: float
    sound: SoundClock
    seconds: float

    @property
    def apart_s(self) -> float:
        """By how much sound and picture certainly lie apart, at the worst moment."""
        late = max(0.0, abs(self.late_s) - SURE * self.sound.error_s)
        if self.sound.drift is None:
            return late
        drift = max(0.0, abs(self.sound.drift.share) - SURE * self.sound.drift.error)
        return late + drift * self.seconds


def clock_sentences(session: Session) -> list[str]:
    """Say how camera and sound card kept time in recordings made by `afferents record`.

    Nothing is said of others: they have no times of frames and of blocks of sound.

    Raises
    ------
    InputError
        If a recording's tables can't be read.
    """
    known = [one for recording in session.recordings if (one := _clocks_of(recording))]
    if not known:
        return []
    late_ms = 1000 * np.array([one.late_s for one in known])
    said = (
        f"Clocks of {len(known)} recordings: sound began {late_ms.min():+.1f} to "
        f"{late_ms.max():+.1f} ms from the picture's zero"
    )
    fps_hz = np.array([one.fps_hz for one in known])
    if np.isfinite(fps_hz).any():
        said += f", {np.nanmin(fps_hz):.3f} to {np.nanmax(fps_hz):.3f} frames a second were taken"
    drifts = [one.sound.drift for one in known if one.sound.drift is not None]
    if drifts:
        typical = sorted(drifts)[len(drifts) // 2]
        said += f", and the sound's clock drifted by {typical.said()} in the median"
    return [f"{said}.", *_far_apart(known)]


def _far_apart(known: list[Clocks]) -> list[str]:
    """Name the recordings in which sound and picture lie more than half a frame apart."""
    far = [one for one in known if one.apart_s * one.fps_hz > LIMIT_FRAMES]
    if not far:
        return []
    worst = max(far, key=lambda one: one.apart_s)
    return [
        f"In {len(far)} of them sound and picture lie more than half a frame apart, most in "
        f"{worst.name} ({1000 * worst.apart_s:.1f} ms): record shorter runs, or from the sound "
        "card itself rather than a sound server."
    ]


def _clocks_of(recording: Recording) -> Clocks | None:
    """Return a recording's clocks; None if it has no table of blocks."""
    if recording.audio is None:
        return None
    folder = Path(recording.audio.path).parent
    if not (folder / SOUND).is_file():
        return None
    table = _read(folder / SOUND)
    rate_hz, origin = recording.audio.sample_rate_hz, (table.schema.metadata or {}).get(ORIGIN)
    if origin is None or not len(table):
        return None
    rows = [BlockRow(*row.values()) for row in table.select(BlockRow._fields).to_pylist()]
    clock = sound_clock(rows, rate_hz)
    seconds = sum(row.n_samples for row in rows) / rate_hz
    late_s = clock.start_s - float(origin)
    return Clocks(recording.name, _frame_rate(folder / FRAMES), late_s, clock, seconds)


def _frame_rate(path: Path) -> float:
    """Return frames a second by their numbers and times; NaN if there is nothing to tell it."""
    if not path.is_file():
        return float("nan")
    table = _read(path)
    number, time_s = (table[name].to_numpy() for name in ("sequence", "time_s"))
    if len(number) < 2 or time_s[-1] <= time_s[0]:
        return float("nan")
    return float((number[-1] - number[0]) / (time_s[-1] - time_s[0]))


def _read(path: Path) -> pa.Table:
    try:
        return pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        expected = "a table that 'afferents record' wrote"
        raise InputError(path, expected, reason_of(error)) from error

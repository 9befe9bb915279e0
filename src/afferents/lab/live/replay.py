"""Recordings played as if they happened now."""

import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import soundfile

from afferents.errors import InputError
from afferents.lab.live.events import CameraFrame, Channel, Event, Sound
from afferents.quality.sound import require_finite
from afferents.recordings.audio import WavFile, sound_name
from afferents.store.recording import Video

CHUNK_S = 0.01
"""Sound is given in pieces of this length, as sound cards do."""


class Pace:
    """One beginning for all that is played together.

    Parameters
    ----------
    speed
        Seconds of the recording in a second; infinite for as fast as possible.
    """

    def __init__(self, speed: float = 1.0) -> None:
        """Begin with the first event that is waited for."""
        if not speed > 0:
            raise InputError(f"--speed: expected a factor above 0, or 'max', found {speed:g}")
        self.speed = speed
        self._lock = threading.Lock()
        self._start_s: float | None = None
        self.closed = threading.Event()

    def now_s(self) -> float:
        """Return the recording's time now, s; 0 before it began."""
        with self._lock:
            if self._start_s is None:
                return 0.0
            return (time.monotonic() - self._start_s) * self.speed

    def wait(self, time_s: float) -> bool:
        """Sleep until the recording's time has come; return whether it goes on then."""
        if not math.isinf(self.speed):
            with self._lock:
                if self._start_s is None:
                    self._start_s = time.monotonic() - time_s / self.speed
                due_s = self._start_s + time_s / self.speed
            self.closed.wait(max(0.0, due_s - time.monotonic()))
        return not self.closed.is_set()

    def rewind(self) -> None:
        """Begin anew with the next event that is waited for."""
        self._start_s = None
        self.closed.clear()


class Played:
    """What plays at a pace."""

    def __init__(self, pace: Pace, begin_s: float) -> None:
        self._pace, self._begin_s = pace, begin_s
        self.speed = pace.speed

    def close(self) -> None:
        """Stop."""
        self._pace.closed.set()

    def rewind(self) -> None:
        """Let `events` begin anew, after it has ended."""
        self._pace.rewind()


class ReplayedVideo(Played):
    """A video as a camera.

    Parameters
    ----------
    video
        Decoded while it plays.
    pace
        Shared with what plays along.
    begin_s
        When it begins, on the clock of all that plays at this pace, s.
    """

    channel: Channel = "video"

    def __init__(self, video: Video, pace: Pace, begin_s: float = 0.0) -> None:
        super().__init__(pace, begin_s)
        self._video = video
        self.rate_hz = video.fps_hz

    def events(self) -> Iterator[Event]:
        """Yield its frames when they are due."""
        for frame in self._video.frames():
            time_s = self._begin_s + frame.time_s
            if not self._pace.wait(time_s):
                return
            yield CameraFrame(frame._replace(time_s=time_s), time.monotonic())
            # A camera's next frame does not come while this one is classified: nor is it decoded.
            self._pace.wait(time_s + 0.5 / self.rate_hz)


class ReplayedSound(Played):
    """A sound file's sensor channel as a microphone.

    Parameters
    ----------
    audio
        Read while it plays.
    pace, begin_s
        As for `ReplayedVideo`.
    """

    channel: Channel = "audio"

    def __init__(self, audio: WavFile, pace: Pace, begin_s: float = 0.0) -> None:
        super().__init__(pace, begin_s)
        if audio.channel >= audio.n_channels:
            found = f"{audio.n_channels} channel(s)"
            raise InputError(
                f"{audio.path}: expected the sensor on channel {audio.channel + 1}, found {found}"
            )
        self._audio = audio
        self.rate_hz = audio.sample_rate_hz

    def events(self) -> Iterator[Event]:
        """Yield its samples when the last of each piece is due."""
        n = 0
        with soundfile.SoundFile(sound_name(self._audio.path)) as file:
            chunk = max(1, round(CHUNK_S * self.rate_hz))
            for block in file.blocks(chunk, dtype="float32", always_2d=True):
                channel = self._audio.channel
                require_finite(block[:, channel], self._audio.path, self.rate_hz, n)
                time_s, n = self._begin_s + n / self.rate_hz, n + len(block)
                if not self._pace.wait(self._begin_s + n / self.rate_hz):
                    return
                samples = np.ascontiguousarray(block[:, channel, np.newaxis])
                yield Sound(time_s, samples, time.monotonic())


def require_recording(path: Path, name: str) -> Path:
    """Return the file of that name in a recording's folder, or the path if it is a file.

    Raises
    ------
    InputError
        If there is none.
    """
    if path.is_dir():
        path = path / name
    if not path.is_file():
        raise InputError(
            f"{path}: expected a recording to replay, such as SESSION/3/50, found no such file"
        )
    return path

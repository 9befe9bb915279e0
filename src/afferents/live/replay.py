"""Recordings played as if they happened now, at true speed, faster, or as fast as possible."""

import math
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import soundfile

from afferents.core.errors import InputError
from afferents.core.recording import Video
from afferents.live.events import CameraFrame, Channel, Event, Sound
from afferents.recordings import WavFile, require_finite

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
        """Begin with the first event that anybody waits for."""
        if not speed > 0:
            raise InputError("--speed", "a factor above 0, or 'max'", f"{speed:g}")
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
        """Sleep until the recording's time has come; tell whether it goes on then."""
        if not math.isinf(self.speed):
            self.closed.wait(max(0.0, self._due_s(time_s) - time.monotonic()))
        return not self.closed.is_set()

    def _due_s(self, time_s: float) -> float:
        """Return when a time of the recording comes, on the monotonic clock."""
        with self._lock:
            if self._start_s is None:
                self._start_s = time.monotonic() - time_s / self.speed
            return self._start_s + time_s / self.speed


class _Played:
    """What plays at a pace."""

    def __init__(self, pace: Pace, begin_s: float) -> None:
        self._pace, self._begin_s = pace, begin_s
        self.speed = pace.speed

    def close(self) -> None:
        """Stop."""
        self._pace.closed.set()


class ReplayedVideo(_Played):
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
            # A camera's next frame does not come while this one is felt: nor is it decoded.
            self._pace.wait(time_s + 0.5 / self.rate_hz)


class ReplayedSound(_Played):
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
            raise InputError(audio.path, f"the sensor on channel {audio.channel + 1}", found)
        self._audio = audio
        self.rate_hz = audio.sample_rate_hz

    def events(self) -> Iterator[Event]:
        """Yield its samples when the last of each piece is due."""
        n = 0
        with soundfile.SoundFile(os.fsencode(self._audio.path)) as file:
            chunk = max(1, round(CHUNK_S * self.rate_hz))
            for block in file.blocks(chunk, dtype="float32", always_2d=True):
                channel = self._audio.channel
                require_finite(block[:, channel], self._audio.path, self.rate_hz, n)
                time_s, n = self._begin_s + n / self.rate_hz, n + len(block)
                if not self._pace.wait(self._begin_s + n / self.rate_hz):
                    return
                samples = np.ascontiguousarray(block[:, channel : channel + 1])
                yield Sound(time_s, samples, time.monotonic())


def recorded(path: Path, name: str) -> Path:
    """Return the file of that name in a recording's folder, or the path if it is a file.

    Raises
    ------
    InputError
        If there is none.
    """
    if path.is_dir():
        path = path / name
    if not path.is_file():
        raise InputError(path, "a recording to replay, such as SESSION/3/50", "no such file")
    return path

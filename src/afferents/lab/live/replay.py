"""Recordings played as if they happened now, and the simulated rig as a running sensor."""

import math
import multiprocessing
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from multiprocessing.pool import AsyncResult
from pathlib import Path

import numpy as np
import soundfile

from afferents.errors import InputError
from afferents.lab.live.events import Begin, CameraFrame, Channel, Event, Sound, Source
from afferents.quality.sound import require_finite
from afferents.recordings.audio import WavFile, sound_name
from afferents.recordings.video import open_video
from afferents.rig.config import Rig
from afferents.rig.drums import texture_name
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.record import AUDIO, VIDEO, record
from afferents.rig.surface import bumped_surface
from afferents.stopping import stop_later
from afferents.store.recording import LETTERS, Video, folder_of

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
        """Sleep until the recording's time has come; tell whether it goes on then."""
        if not math.isinf(self.speed):
            with self._lock:
                if self._start_s is None:
                    self._start_s = time.monotonic() - time_s / self.speed
                due_s = self._start_s + time_s / self.speed
            self.closed.wait(max(0.0, due_s - time.monotonic()))
        return not self.closed.is_set()

    def rewind(self) -> None:
        """Begin anew with the next event that anybody waits for."""
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
        raise InputError(
            f"{path}: expected a recording to replay, such as SESSION/3/50, found no such file"
        )
    return path


# The simulated rig as a running sensor: drum after drum, recorded while the one before plays.

RUN_S = 10.0
"""Length of a run, s."""
SPEEDS_MM_S = (20, 30, 40, 50, 60, 70, 80, 90)


_LOOK_S = 0.1
"""So often who waits for a run looks whether the show is closed, s."""


class RigShow:
    """Runs of the rig one after another, each recorded as mp4 and wav before it plays.

    Parameters
    ----------
    texture, speed_mm_s
        What every run is of; None to draw a drum and a speed for each.
    seed
        Of the draws and the simulation.
    run_s
        Length of a run, s.
    rig
        With its fingertip; None for the rig's own.
    """

    def __init__(
        self,
        texture: str | None = None,
        speed_mm_s: float | None = None,
        seed: int = 0,
        run_s: float = RUN_S,
        rig: Rig | None = None,
    ) -> None:
        """Prepare a process that records."""
        self._texture = None if texture is None else texture_name(texture, {})
        self._speed_mm_s = speed_mm_s
        self._seed, self._run_s = seed, run_s
        self._rig = (rig or Rig()).printed(seed)
        self._folder = tempfile.TemporaryDirectory(
            prefix="afferents-rig-", ignore_cleanup_errors=True
        )
        # Ctrl-C is for the one who started it all.
        ignore = (signal.SIGINT, signal.SIG_IGN)
        with stop_later():  # a process that has half begun would complain
            self._process = multiprocessing.get_context("spawn").Pool(1, signal.signal, ignore)
        self._lock = threading.Lock()
        self._runs: dict[int, AsyncResult[Path]] = {}
        self._begins_s: dict[int, float] = {}
        self.pace = Pace()

    def drawn(self, number: int) -> tuple[str, float]:
        """Return texture and speed, mm/s, of the run of that number."""
        rng = np.random.default_rng([self._seed, number])
        texture = self._texture or folder_of(LETTERS[rng.integers(len(LETTERS))])
        speed = self._speed_mm_s or float(SPEEDS_MM_S[rng.integers(len(SPEEDS_MM_S))])
        return texture, speed

    def take(self, number: int) -> tuple[Path, float] | None:
        """Return the folder of a run once it is recorded, and when it begins to play, s.

        The next is then begun. A run begins when the one before ends, or when it is ready. None if
        the show is closed before that: what is not recorded then never will be.
        """
        with self._lock:
            for n in (number, number + 1):
                if n not in self._runs:
                    where = self._folder_of(n)
                    asked = (self._rig, where, *self.drawn(n), self._run_s, self._seed, n + 1)
                    self._runs[n] = self._process.apply_async(_recorded, asked)
            for old in [n for n in self._runs if n < number - 1]:
                del self._runs[old]
                shutil.rmtree(self._folder_of(old), ignore_errors=True)
            recorded = self._runs[number]
        while not recorded.ready():
            if self.pace.closed.is_set():
                return None
            recorded.wait(_LOOK_S)
        folder = recorded.get()
        with self._lock:
            if number not in self._begins_s:
                before_s = self._begins_s.get(number - 1, -self._run_s) + self._run_s
                self._begins_s[number] = max(before_s, self.pace.now_s())
            return folder, self._begins_s[number]

    def close(self) -> None:
        """Stop, and remove what was recorded."""
        self.pace.closed.set()
        self._process.terminate()
        self._folder.cleanup()

    def _folder_of(self, number: int) -> Path:
        return Path(self._folder.name) / f"{number}"


def _recorded(
    rig: Rig, folder: Path, texture: str, speed_mm_s: float, seconds: float, seed: int, again: int
) -> Path:
    """Record a run in a process of its own: mounted as the seed's session, but none of its runs."""
    surface = bumped_surface(float(texture), rig.drum)
    record(rig, folder, texture, surface, speed_mm_s, seconds, seed, again=again)
    return folder


class _Rigged:
    """What plays runs one after another."""

    speed = 1.0
    channel: Channel

    def __init__(self, show: RigShow) -> None:
        self._show = show

    def close(self) -> None:
        """Stop."""
        self._show.close()

    def events(self) -> Iterator[Event]:
        """Yield what happens in run after run."""
        number = 0
        while not self._show.pace.closed.is_set():
            if (taken := self._show.take(number)) is None:
                return
            folder, begin_s = taken
            texture, speed_mm_s = self._show.drawn(number)
            yield Begin(self.channel, begin_s, f"{texture} mm at {speed_mm_s:g} mm/s")
            yield from self._player(folder, begin_s).events()
            number += 1

    def _player(self, folder: Path, begin_s: float) -> Source:
        raise NotImplementedError


class RigVideo(_Rigged):
    """The rig's camera."""

    channel: Channel = "video"
    rate_hz = Rig().camera.fps_hz

    def _player(self, folder: Path, begin_s: float) -> Source:
        return ReplayedVideo(open_video(folder / VIDEO), self._show.pace, begin_s)


class RigSound(_Rigged):
    """The rig's microphone."""

    channel: Channel = "audio"
    rate_hz = float(SAMPLE_RATE_HZ)

    def _player(self, folder: Path, begin_s: float) -> Source:
        return ReplayedSound(WavFile(folder / AUDIO), self._show.pace, begin_s)

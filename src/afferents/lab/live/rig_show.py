"""The simulated rig as a running sensor: drum after drum, recorded while the one before plays."""

import itertools
import multiprocessing
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator
from multiprocessing.pool import AsyncResult
from pathlib import Path

import numpy as np

from afferents.lab.live.events import Begin, Channel, Event, Source
from afferents.lab.live.replay import Pace, ReplayedSound, ReplayedVideo
from afferents.recordings import audio, video
from afferents.rig import drums, microphone
from afferents.rig.config import Rig
from afferents.rig.record import AUDIO, VIDEO, record
from afferents.rig.surface import bumped_surface
from afferents.stopping import stop_later
from afferents.store.recording import LETTERS, name_folder

RUN_S = 10.0
"""Length of a run, s."""
SPEEDS_MM_S = (20, 30, 40, 50, 60, 70, 80, 90)
_LOOK_S = 0.1
"""While a run is waited for, the show is looked at this often, s: it may be closed."""


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
        self._texture = None if texture is None else drums.texture_name(texture, {})
        self._speed_mm_s = speed_mm_s
        self._seed, self._run_s = seed, run_s
        self._rig = (rig or Rig()).printed(seed)
        self._kept = tempfile.TemporaryDirectory(
            prefix="afferents-rig-", ignore_cleanup_errors=True
        )
        self.folder = Path(self._kept.name)
        # Ctrl-C is for the process that started it all.
        ignore = (signal.SIGINT, signal.SIG_IGN)
        with stop_later():  # a process that has half begun would complain
            self._process = multiprocessing.get_context("spawn").Pool(1, signal.signal, ignore)
        self._lock = threading.Lock()
        self._runs: dict[int, AsyncResult[Path]] = {}
        self._begins_s: dict[int, float] = {}
        self.pace = Pace()

    def draw(self, number: int) -> tuple[str, float]:
        """Return texture and speed, mm/s, of the run of that number."""
        rng = np.random.default_rng([self._seed, number])
        texture = self._texture or name_folder(LETTERS[rng.integers(len(LETTERS))])
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
                    run = self.folder / f"{n}", *self.draw(n), self._run_s, self._seed, n + 1
                    self._runs[n] = self._process.apply_async(_record_run, (self._rig, *run))
            for old in [n for n in self._runs if n < number - 1]:
                del self._runs[old]
                shutil.rmtree(self.folder / f"{old}", ignore_errors=True)
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
        self._kept.cleanup()


def _record_run(
    rig: Rig, folder: Path, texture: str, speed_mm_s: float, seconds: float, seed: int, again: int
) -> Path:
    """Record a run in a process of its own: mounted as the seed's session, but none of its runs."""
    surface = bumped_surface(float(texture), rig.drum)
    record(rig, folder, texture, surface, speed_mm_s, seconds, seed, again=again)
    return folder


class _RigSource:
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
        for number in itertools.count():
            if self._show.pace.closed.is_set() or (taken := self._show.take(number)) is None:
                return
            texture, speed_mm_s = self._show.draw(number)
            folder, begin_s = taken
            yield Begin(self.channel, begin_s, f"{texture} mm at {speed_mm_s:g} mm/s")
            yield from self._play(folder, begin_s).events()

    def _play(self, folder: Path, begin_s: float) -> Source:
        raise NotImplementedError


class RigVideo(_RigSource):
    """The rig's camera."""

    channel: Channel = "video"
    rate_hz = Rig().camera.fps_hz

    def _play(self, folder: Path, begin_s: float) -> Source:
        return ReplayedVideo(video.open_video(folder / VIDEO), self._show.pace, begin_s)


class RigSound(_RigSource):
    """The rig's microphone."""

    channel: Channel = "audio"
    rate_hz = float(microphone.SAMPLE_RATE_HZ)

    def _play(self, folder: Path, begin_s: float) -> Source:
        return ReplayedSound(audio.WavFile(folder / AUDIO), self._show.pace, begin_s)

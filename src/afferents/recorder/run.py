"""One run: camera, microphone and drive at once, until it is over or something fails."""

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from afferents.devices.base import Block, Camera, DeviceError, Drive, DriveState, Frame, Microphone
from afferents.devices.picture import is_torn
from afferents.errors import AfferentsError, reason_of
from afferents.recorder.files import Film, Sound
from afferents.recorder.plan import Clock, Plan
from afferents.recorder.watch import Watch
from afferents.recordings.run_log import BlockRow, DriveRow, FrameRow, Log, sound_clock
from afferents.store.drum_path import Drum

VIDEO, AUDIO, DAMAGED = "video.mp4", "audio.wav", "damaged"
LOOK_S = 0.02
"""The drive is read this often: its watchdog lets it turn for half a second without."""
TAIL_S = 0.2
"""Devices go on for so long: what was taken in time may arrive later."""
LISTEN_S, LISTEN_SHARE = 1.0, 0.8
"""A run begins with the first block of sound after the warm-up; when that was is told from all
blocks of so long, or of such a share of the time until the drum starts, whichever is less."""
FIRST_S = 5.0
"""Camera and microphone give something within this time, or the run fails."""
WARM_UP = 10
"""Frames of a camera that starts; the run begins after them."""
AT_REST = 10
"""This frame is looked at for the skin at rest."""
MOST_WAITING = 2000
"""Frames that may wait for the disk; a run whose disk is slower than its camera fails, and none of
its frames is dropped before."""
_FULL = 32767


@dataclass(frozen=True)
class Devices:
    """What a run is made with, opened; without a microphone there is no sound."""

    camera: Camera
    microphone: Microphone | None
    drive: Drive
    clock: Clock


class RunFailedError(AfferentsError):
    """A run could not be brought to its end: one sentence. What there is of it is kept aside.

    Parameters
    ----------
    why
        The sentence.
    ends_plan
        Whether the next run would fail as well: the disk is full.
    """

    def __init__(self, why: str, ends_plan: bool = False) -> None:
        """Keep both."""
        super().__init__(why)
        self.ends_plan = ends_plan


class Run:
    """Makes one run in a folder.

    Parameters
    ----------
    folder
        Where its files are written; it is there.
    speed_mm_s
        Of the drum.
    watch
        Where who looks on finds the newest of it.
    drum
        That the drive turns, where it is known.
    """

    def __init__(
        self,
        devices: Devices,
        plan: Plan,
        folder: Path,
        speed_mm_s: float,
        watch: Watch | None = None,
        drum: Drum | None = None,
    ) -> None:
        """Touch no device yet."""
        self._devices, self._plan, self._folder = devices, plan, folder
        self._watch = watch or Watch()
        self._speed_mm_s, self._set_mm_s = speed_mm_s, 0.0
        self.log = Log(drum=drum)
        self._seen, self._begun = threading.Event(), threading.Event()
        self._over = threading.Event()
        self._fault: BaseException | None = None
        self._waiting: queue.SimpleQueue[Frame | None] = queue.SimpleQueue()

    def make(self) -> Log:
        """Make the run; whatever happens, the drum stands still afterwards.

        Returns
        -------
        Log
            What was noted; the tables are written too, of a run that failed as well.

        Raises
        ------
        RunFailedError
            If a device goes away, the drive reports a fault, or the disk is full.
        """
        threads = [
            threading.Thread(target=self._guarded, args=(work,), name=work.__name__, daemon=True)
            for work in self._work()
        ]
        self._watch.begin()
        for thread in threads:
            thread.start()
        try:
            self._conduct()
        finally:
            self._devices.drive.stop()
            self._over.set()
            self._devices.camera.end()
            if self._devices.microphone is not None:
                self._devices.microphone.end()
            for thread in threads:
                thread.join(timeout=FIRST_S)
            with suppress(OSError):  # of a full disk: the fault that is raised below
                self.log.write(self._folder)
        if self._fault is not None:
            raise _failure(self._fault) from self._fault
        return self.log

    def _work(self) -> list[Callable[[], None]]:
        works: list[Callable[[], None]] = [self._capture, self._store]
        if self._devices.microphone is not None:
            works.append(self._hear)
        return works

    def _guarded(self, work: Callable[[], None]) -> None:
        """Do the work of a thread; its error ends the run."""
        try:
            work()
        except Exception as error:  # noqa: BLE001  raised again in the main thread
            if not (self._over.is_set() and isinstance(error, DeviceError)):
                self._fault = self._fault or error
            self._over.set()

    def _conduct(self) -> None:
        """Start and watch the drive until the run is over."""
        clock, plan = self._devices.clock, self._plan
        latest_s = clock.now() + FIRST_S
        while not self._begun.is_set():
            if clock.wait(LOOK_S, self._over):
                return
            if clock.now() > latest_s:
                raise RunFailedError(
                    f"camera or microphone gave nothing for {FIRST_S:g} s; look at their plugs"
                )
        assert self.log.origin_s is not None
        while not self._over.is_set():
            elapsed_s = clock.now() - self.log.origin_s
            if elapsed_s >= plan.total_s + TAIL_S:
                return
            if elapsed_s >= plan.start_s and not self._set_mm_s:
                self._set_mm_s = self._speed_mm_s
                self._devices.drive.start(self._speed_mm_s)
            self._note(self._devices.drive.read(), elapsed_s)
            self._watch.heed()
            if self._watch.wants_redo:
                raise RunFailedError("somebody asked for it once more")
            clock.wait(LOOK_S, self._over)

    def _note(self, state: DriveState, elapsed_s: float) -> None:
        self._watch.drive(state, self._set_mm_s, elapsed_s)
        self.log.drive.append(DriveRow(*state[:3], self._set_mm_s, state.fault))
        if state.fault is not None:
            raise RunFailedError(f"the drive reports a fault: {state.fault}")

    def _capture(self) -> None:
        """Take frames from the camera, and nothing else: the disk may be slow, this never waits."""
        for number, frame in enumerate(self._devices.camera.frames()):
            self._waiting.put(frame)
            self._watch.frame(frame)
            if number == WARM_UP:
                self._seen.set()
            if self._over.is_set():
                break
            if self._waiting.qsize() > MOST_WAITING:
                raise DeviceError("the disk is slower than the camera; record to another one")
        self._waiting.put(None)
        if not self._over.is_set():
            raise DeviceError("the camera gave no more frames")

    def _store(self) -> None:
        """Write frames; those before the sound begins, or after the run, belong to none."""
        film = Film(self._folder / VIDEO, self._devices.camera.settings)
        before = b""
        try:
            if self._devices.microphone is not None:
                self._wait_for_sound()
            while (frame := self._next()) is not None:
                origin_s = self._origin_s(frame)
                if origin_s is None or not 0 <= frame.time_s - origin_s < self._plan.total_s:
                    continue
                self._write(film, frame, origin_s, frame.data == before)
                before = frame.data
        finally:
            film.close()

    def _wait_for_sound(self) -> None:
        """Wait until it is known when the run began; frames wait meanwhile."""
        while not self._begun.wait(LOOK_S) and not self._over.is_set():
            pass

    def _next(self) -> Frame | None:
        """Return the next frame; None when there are no more."""
        while True:
            try:
                return self._waiting.get(timeout=LOOK_S)
            except queue.Empty:
                if self._over.is_set():
                    return None

    def _origin_s(self, frame: Frame) -> float | None:
        """Return when the run began; None while sound is waited for."""
        silent = self._devices.microphone is None
        if self.log.origin_s is None and silent and self._seen.is_set():
            self._begin(frame.time_s)
        return self.log.origin_s

    def _begin(self, origin_s: float) -> None:
        self.log.origin_s = origin_s
        self._begun.set()

    def _write(self, film: Film, frame: Frame, origin_s: float, repeated: bool) -> None:
        damaged = frame.damaged or is_torn(frame.data, self._devices.camera.settings)
        if damaged:  # no decoder goes on after it; it is kept beside the video
            aside = self._folder / DAMAGED
            aside.mkdir(exist_ok=True)
            (aside / f"{frame.sequence}").write_bytes(frame.data)
        else:
            film.write(frame.data, frame.time_s - origin_s)
            self.log.last = frame.data
            if len(self.log.frames) <= AT_REST:
                self.log.rest = frame.data
        now_s = self._devices.clock.now()
        row = FrameRow(frame.sequence, frame.time_s, now_s, damaged, repeated, not damaged)
        self.log.frames.append(row)

    def _hear(self) -> None:
        """Write the sound, from the first block after the warm-up until the run is over."""
        microphone = self._devices.microphone
        assert microphone is not None
        settings = microphone.settings
        sound = Sound(self._folder / AUDIO, settings.rate_hz, settings.channels)
        most = round(self._plan.total_s * settings.rate_hz)
        listened = round(min(LISTEN_S, LISTEN_SHARE * self._plan.start_s) * settings.rate_hz)
        try:
            for block in microphone.blocks():
                self._watch.block(block)
                if not self._seen.is_set():
                    continue
                if self._over.is_set() and sound.n_samples >= most:
                    return
                self._write_block(sound, block, most)
                if self.log.origin_s is None and sound.n_samples >= listened:
                    self._begin(sound_clock(self.log.blocks, settings.rate_hz).start_s)
        finally:
            sound.close()
        if not self._over.is_set():
            raise DeviceError("the microphone gave no more sound")

    def _write_block(self, sound: Sound, block: Block, most: int) -> None:
        """Write a block; no more than the run is long."""
        samples = block.samples[: max(0, most - sound.n_samples)]
        row = BlockRow(block.time_s, sound.n_samples, len(samples), block.overflowed)
        if not len(samples):
            return
        self.log.blocks.append(row)
        channel = self._plan.sensor_channel
        level = np.abs(samples[:, -1 if channel is None else channel].astype(np.int32))
        self.log.peak = max(self.log.peak, int(level.max()))
        self.log.clipped += int((level >= _FULL).sum())
        sound.write(samples)


def _failure(fault: BaseException) -> BaseException:
    """Return the error of a run whose thread had a fault."""
    if isinstance(fault, AfferentsError):
        return RunFailedError(str(fault))
    if isinstance(fault, OSError | av.FFmpegError):
        why = f"what was recorded can't be written: {reason_of(fault)}; make room on the disk"
        return RunFailedError(why, ends_plan=True)
    return fault

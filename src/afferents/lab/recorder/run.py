"""One run: camera, microphone and drive at once, until it is over or something fails."""

import math
import queue
import threading
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import av
import numpy as np

from afferents.errors import AfferentsError, reason_of
from afferents.lab.devices.base import Block, DeviceError, Frame
from afferents.lab.devices.picture import is_torn
from afferents.lab.recorder.devices import PATIENCE_S, Devices
from afferents.lab.recorder.plan import RecordingPlan
from afferents.lab.recorder.watch import Watch
from afferents.lab.writers import SoundWriter, VideoWriter
from afferents.recordings.layouts import AUDIO, VIDEO
from afferents.recordings.run_log import BlockRow, DriveRow, FrameRow, Log
from afferents.recordings.sound_clock import sound_clock
from afferents.store.drum_path import Drum

DAMAGED = "damaged"
LOOK_S = 0.02
"""The drive is read this often: its watchdog lets it turn for half a second without."""
TAIL_S = 0.2
"""Devices go on for this time, s: what was taken in time may arrive later."""
LISTEN_S, LISTEN_SHARE = 1.0, 0.8
"""A run begins with the first block of sound after the warm-up; when that was follows from all
blocks of this time, or of this share of the time until the drum starts, whichever is less."""
WARM_UP = 10
"""Frames of a camera that starts; the run begins after them."""
AT_REST = 10
"""This frame is looked at for the skin at rest."""
MOST_WAITING = 2000
"""Frames that may wait for the disk; a run whose disk is slower than its camera fails, and none of
its frames is dropped before."""
_FULL = 32767


class DiskFullError(AfferentsError):
    """What is recorded can't be written: the next run would fail as well."""


class RedoRequestedError(AfferentsError):
    """A request to make the run once more: no device has failed."""

    def __init__(self) -> None:
        """Say it."""
        super().__init__("it was requested once more")


class Run:
    """Makes one run in a folder.

    Parameters
    ----------
    folder
        Where its files are written; it is there.
    speed_mm_s
        Of the drum.
    watch
        Shows it on a page.
    drum
        That the drive turns, where it is known.
    """

    def __init__(
        self,
        devices: Devices,
        plan: RecordingPlan,
        folder: Path,
        speed_mm_s: float,
        watch: Watch | None = None,
        drum: Drum | None = None,
    ) -> None:
        """Touch no device yet."""
        self._devices, self._plan, self._folder = devices, plan, folder
        self._watch = watch or Watch()
        self._speed_mm_s = speed_mm_s
        self.log = Log(drum=drum)
        self._n_frames = 0
        self._begun, self._over = threading.Event(), threading.Event()
        self._fault: Exception | None = None
        self._waiting: queue.SimpleQueue[Frame | None] = queue.SimpleQueue()

    def make(self) -> Log:
        """Make the run; whatever happens, the drum stands still afterwards.

        Returns
        -------
        Log
            What was noted; the tables are written too, also of a run that failed.

        Raises
        ------
        DeviceError
            If a device goes away, or the drive reports a fault.
        DiskFullError
            If what is recorded can't be written.
        RedoRequestedError
            If it is requested once more.
        """
        sound = self._devices.sound
        self._watch.begin()
        try:
            with ExitStack() as files:
                settings = self._devices.camera.settings
                video = files.enter_context(closing(VideoWriter(self._folder / VIDEO, settings)))
                audio = None
                if sound is not None:
                    writer = SoundWriter(self._folder / AUDIO, sound.rate_hz, sound.channels)
                    audio = files.enter_context(closing(writer))
                storing = threading.Thread(target=self._store, args=(video,), daemon=True)
                storing.start()
                files.callback(storing.join)
                files.callback(self._waiting.put, None)  # before it: the last to be stored
                with self._devices.stream(
                    self._take, lambda block: self._write_block(audio, block), self._fail
                ):
                    try:
                        self._conduct()
                    finally:
                        self._devices.drive.stop()
                        self._over.set()
        except (OSError, av.FFmpegError) as error:
            self._fail(error)
        finally:
            # A full disk is the fault that is raised below.
            with suppress(OSError, AfferentsError):
                self.log.write(self._folder)
        if isinstance(self._fault, OSError | av.FFmpegError):
            why = reason_of(self._fault)
            raise DiskFullError(
                f"what was recorded can't be written: {why}; make room on the disk"
            ) from self._fault
        if self._fault is not None:
            raise self._fault
        return self.log

    def _fail(self, error: Exception) -> None:
        """End the run, in whichever thread the first error comes; the main thread raises it."""
        self._fault = self._fault or error
        self._over.set()

    def _conduct(self) -> None:
        """Start and watch the drive until the run is over."""
        clock, drive, plan, set_mm_s = self._devices.clock, self._devices.drive, self._plan, 0.0
        latest_s = clock.now() + PATIENCE_S
        while not self._begun.is_set():
            if clock.wait(LOOK_S, self._over):
                return
            if clock.now() > latest_s:
                raise DeviceError(
                    f"camera or microphone gave nothing for {PATIENCE_S:g} s; look at their plugs"
                )
        assert self.log.origin_s is not None
        while not self._over.is_set():
            elapsed_s = clock.now() - self.log.origin_s
            if elapsed_s >= plan.total_s + TAIL_S:
                return
            if elapsed_s >= plan.start_s and not set_mm_s:
                set_mm_s = self._speed_mm_s
                drive.start(set_mm_s)
            state = drive.read()
            self._watch.take_drive(state, set_mm_s, elapsed_s)
            time_s, way_mm, mm_s = (math.nan if value is None else value for value in state[:3])
            self.log.drive.append(DriveRow(time_s, way_mm, mm_s, set_mm_s, state.fault))
            state.raise_fault()
            self._watch.stop_if_requested()
            if self._watch.wants_redo:
                raise RedoRequestedError
            clock.wait(LOOK_S, self._over)

    def _begin(self, origin_s: float) -> None:
        self.log.origin_s = origin_s
        self._begun.set()

    def _take(self, frame: Frame) -> None:
        """Take a frame from the camera, and no more: the disk may be slow, this never waits."""
        self._waiting.put(frame)
        self._watch.take_frame(frame)
        self._n_frames += 1
        if self._devices.microphone is None and self._n_frames == WARM_UP + 1:
            self._begin(frame.time_s)
        if self._waiting.qsize() > MOST_WAITING:
            raise DeviceError("the disk is slower than the camera; record to another one")

    def _store(self, video: VideoWriter) -> None:
        """Write frames; those before the run began, or after it, belong to none."""
        before = b""
        try:
            while not self._begun.wait(LOOK_S) and not self._over.is_set():
                pass  # frames wait until it is known when that was
            while (frame := self._waiting.get()) is not None:
                origin_s = self.log.origin_s
                if origin_s is None or not 0 <= frame.time_s - origin_s < self._plan.total_s:
                    continue
                self._write(video, frame, origin_s, frame.data == before)
                before = frame.data
        except Exception as error:  # noqa: BLE001  raised again in the main thread
            self._fail(error)

    def _write(self, video: VideoWriter, frame: Frame, origin_s: float, repeated: bool) -> None:
        damaged = frame.damaged or is_torn(frame.data, self._devices.camera.settings)
        if damaged:  # no decoder goes on after it; it is kept next to the video
            aside = self._folder / DAMAGED
            aside.mkdir(exist_ok=True)
            (aside / f"{frame.sequence}").write_bytes(frame.data)
        else:
            video.write(frame.data, frame.time_s - origin_s)
            self.log.last = frame.data
            if len(self.log.frames) <= AT_REST:
                self.log.rest = frame.data
        now_s = self._devices.clock.now()
        row = FrameRow(frame.sequence, frame.time_s, now_s, damaged, repeated, not damaged)
        self.log.frames.append(row)

    def _write_block(self, audio: SoundWriter | None, block: Block) -> None:
        """Write a block after the warm-up, and no more than the run is long."""
        self._watch.blocks.append(block)
        sound = self._devices.sound
        if self._n_frames <= WARM_UP or audio is None or sound is None:
            return
        most = round(self._plan.total_s * sound.rate_hz)
        samples = block.samples[: max(0, most - audio.n_samples)]
        if not len(samples):
            return
        log = self.log
        log.blocks.append(BlockRow(block.time_s, audio.n_samples, len(samples), block.overflowed))
        level = np.abs(samples[:, self._plan.channel].astype(np.int32))
        log.peak = max(log.peak, int(level.max()))
        log.clipped += int((level >= _FULL).sum())
        audio.write(samples)
        listened_s = min(LISTEN_S, LISTEN_SHARE * self._plan.start_s)
        if log.origin_s is None and audio.n_samples >= round(listened_s * sound.rate_hz):
            self._begin(sound_clock(log.blocks, sound.rate_hz).start_s)

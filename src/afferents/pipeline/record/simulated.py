"""Devices for a dry run: their camera sees the simulated rig's film, their microphone hears it.

Faults can be asked for in the plan, to see what becomes of them.
"""

import threading
from collections.abc import Iterator
from typing import Annotated, Generic, Literal, TypeVar

import numpy as np
from pydantic import Field

from afferents.devices import (
    Block,
    Camera,
    CameraSettings,
    DeviceError,
    Drive,
    DriveLimits,
    DriveState,
    Frame,
    Microphone,
    MicrophoneSettings,
    Options,
)
from afferents.devices.base import Device
from afferents.pipeline.record.bench import Bench, Faulty
from afferents.rig.microphone import SAMPLE_RATE_HZ

Numbers = tuple[Annotated[int, Field(ge=0)], ...]
_BLOCK = 441


class SimulatedOptions(Faulty):
    """Base of the options of simulated devices."""

    kind: Literal["simulated"] = "simulated"


class SimulatedCameraOptions(SimulatedOptions):
    """A camera and its faults.

    Attributes
    ----------
    lost, damaged, repeated
        Numbers of frames, from 0 at the start of a run.
    unplugged_at
        Number of the frame instead of which the camera is gone; None for never.
    """

    lost: Numbers = ()
    damaged: Numbers = ()
    repeated: Numbers = ()
    unplugged_at: int | None = Field(None, ge=0)


class SimulatedCamera(Camera):
    """Gives the rig's film as JPEGs, each at its time."""

    Options = SimulatedCameraOptions

    def __init__(self, options: SimulatedCameraOptions, bench: Bench) -> None:
        """Look at the bench."""
        self.options, self._bench = options, bench
        self._ended = threading.Event()

    def open(self) -> None:
        """Say how it is set."""
        camera = self._bench.rig.camera
        self.settings = CameraSettings(
            "simulated", "MJPG", camera.width, camera.height, camera.fps_hz
        )

    def close(self) -> None:
        """End."""
        self._ended.set()

    def end(self) -> None:
        """Let `frames` end soon."""
        self._ended.set()

    def frames(self) -> Iterator[Frame]:
        """Yield the film of the drum that is mounted."""
        self._ended.clear()
        zero_s, film = self._bench.roll()
        faults = self._bench.faults(self.options)
        shown = b""
        for number, time_s in enumerate(film.time_s):
            if self._bench.clock.wait(zero_s + time_s - self._bench.clock.now(), self._ended):
                return
            if number == faults.unplugged_at:
                raise DeviceError("camera simulated: it was unplugged")
            if number in faults.lost:
                continue
            shown = shown if number in faults.repeated else film.jpegs[number]
            damaged = number in faults.damaged
            data = shown[: len(shown) // 2] if damaged else shown
            yield Frame(number, zero_s + float(time_s), damaged, data)
        self._ended.wait()


class SimulatedMicrophoneOptions(SimulatedOptions):
    """A microphone and its faults.

    Attributes
    ----------
    gone_at_s, overflow_at_s
        When it vanishes or loses samples, s from the start of a run; None for never.
    silent
        Whether it gives nothing but zeros.
    offset_ms
        How far its clock is ahead of the camera's, always.
    """

    gone_at_s: float | None = None
    overflow_at_s: float | None = None
    silent: bool = False
    offset_ms: float = Field(0.0, ge=-100, le=100)


class SimulatedMicrophone(Microphone):
    """Gives the rig's sound."""

    Options = SimulatedMicrophoneOptions

    def __init__(self, options: SimulatedMicrophoneOptions, bench: Bench) -> None:
        """Listen at the bench."""
        self.options, self._bench = options, bench
        self._ended = threading.Event()

    def open(self) -> None:
        """Say how it is set."""
        self.settings = MicrophoneSettings("simulated", float(SAMPLE_RATE_HZ), 2)

    def close(self) -> None:
        """End."""
        self._ended.set()

    def end(self) -> None:
        """Let `blocks` end soon."""
        self._ended.set()

    def blocks(self) -> Iterator[Block]:
        """Yield the sound of the drum that is mounted."""
        self._ended.clear()
        zero_s, film = self._bench.roll()
        faults = self._bench.faults(self.options)
        lost = -1 if faults.overflow_at_s is None else int(faults.overflow_at_s * 100)
        for number, first in enumerate(range(0, len(film.sound), _BLOCK)):
            time_s = first / SAMPLE_RATE_HZ
            ends_s = zero_s + time_s + _BLOCK / SAMPLE_RATE_HZ
            if self._bench.clock.wait(ends_s - self._bench.clock.now(), self._ended):
                return
            if faults.gone_at_s is not None and time_s >= faults.gone_at_s:
                raise DeviceError("microphone simulated: it was unplugged")
            if number == lost:
                continue
            samples = film.sound[first : first + _BLOCK]
            quiet = np.zeros_like(samples) if faults.silent else samples
            ahead_s = self.options.offset_ms / 1000
            yield Block(zero_s + time_s + ahead_s, quiet, number == lost + 1 > 0)
        self._ended.wait()


class SimulatedDriveOptions(SimulatedOptions):
    """A drive and its faults.

    Attributes
    ----------
    off
        By how much its speed differs from what is asked for, as a share.
    fault_at_s
        When it reports a fault, s from the start of a run; None for never.
    """

    off: float = 0.0
    fault_at_s: float | None = None


class SimulatedDrive(Drive):
    """Turns the rig's drum."""

    Options = SimulatedDriveOptions

    def __init__(self, options: SimulatedDriveOptions, bench: Bench) -> None:
        """Stand on the bench."""
        self.options, self._bench = options, bench

    def open(self) -> None:
        """Say what it can do."""
        self.limits = DriveLimits(1.0, 500.0)

    def close(self) -> None:
        """Stop."""
        self.stop()

    def start(self, speed_mm_s: float) -> None:
        """Turn."""
        self._bench.turn(speed_mm_s)

    def read(self) -> DriveState:
        """Return where the drum of the film is."""
        now_s, rolled_s, position, speed = self._bench.drum()
        faults = self._bench.faults(self.options)
        faulty = faults.fault_at_s is not None and rolled_s >= faults.fault_at_s
        return DriveState(
            now_s, position, speed * (1 + faults.off), "over current" if faulty else None
        )

    def stop(self) -> None:
        """Let the drum stand."""
        self._bench.turn(0.0)


Made = TypeVar("Made", bound=Device, covariant=True)


class _OnBench(Generic[Made]):
    """A kind of devices that stand on one bench, as `devices.table` wants kinds."""

    def __init__(self, kind: type[Made], bench: Bench) -> None:
        self._kind, self._bench = kind, bench

    @property
    def Options(self) -> type[Options]:  # noqa: N802  # a class
        """The form of its options."""
        options: type[Options] = self._kind.Options  # type: ignore[attr-defined]
        return options

    def __call__(self, options: object) -> Made:
        """Make one."""
        return self._kind(options, self._bench)  # type: ignore[call-arg]


NAME = "simulated"


def cameras(bench: Bench) -> dict[str, _OnBench[Camera]]:
    """Return the kinds of cameras of a dry run."""
    return {NAME: _OnBench(SimulatedCamera, bench)}


def microphones(bench: Bench) -> dict[str, _OnBench[Microphone]]:
    """Return the kinds of microphones of a dry run."""
    return {NAME: _OnBench(SimulatedMicrophone, bench)}


def drives(bench: Bench) -> dict[str, _OnBench[Drive]]:
    """Return the kinds of drives of a dry run."""
    return {NAME: _OnBench(SimulatedDrive, bench)}

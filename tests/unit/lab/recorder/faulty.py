"""Devices of a dry run with faults, at the first attempt of a run."""

from dataclasses import dataclass

import numpy as np

from afferents.lab.devices.base import DeviceError
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.rehearsal import SimulatedCamera, SimulatedDrive, SimulatedMicrophone

BLOCKS_A_S = 100


@dataclass(frozen=True)
class Faults:
    """What is wrong with the devices.

    Attributes
    ----------
    lost, damaged, repeated
        Numbers of frames, from 0 at the start of a run.
    unplugged_at
        Number of the frame instead of which the camera is gone.
    gone_at_s, overflow_at_s
        When the microphone vanishes or loses samples, s from the start of a run.
    silent
        Whether the microphone gives nothing but zeros.
    offset_ms
        How far the microphone's clock is ahead of the camera's, in every attempt.
    off
        By how much the drive's speed differs from what it was set to, as a share.
    fault_at_s
        When the drive reports a fault, s from the start of a run.
    """

    lost: tuple = ()
    damaged: tuple = ()
    repeated: tuple = ()
    unplugged_at: int = -1
    gone_at_s: float = np.inf
    overflow_at_s: float = np.inf
    silent: bool = False
    offset_ms: float = 0
    off: float = 0
    fault_at_s: float = np.inf


class FaultyCamera(SimulatedCamera):
    def __init__(self, bench, faults):
        super().__init__(bench)
        self._faults = faults

    def frames(self):
        faults, shown = self._faults if self._bench.attempt == 1 else Faults(), b""
        for frame in super().frames():
            if frame.sequence == faults.unplugged_at:
                raise DeviceError("camera simulated: it was unplugged")
            if frame.sequence in faults.lost:
                continue
            shown = shown if frame.sequence in faults.repeated else frame.data
            damaged = frame.sequence in faults.damaged
            yield frame._replace(damaged=damaged, data=shown[: len(shown) // (1 + damaged)])


class FaultyMicrophone(SimulatedMicrophone):
    def __init__(self, bench, faults):
        super().__init__(bench)
        self._faults = faults

    def blocks(self):
        faults = self._faults if self._bench.attempt == 1 else Faults()
        for number, block in enumerate(super().blocks()):
            begun_s = number / BLOCKS_A_S
            if begun_s >= faults.gone_at_s:
                raise DeviceError("microphone simulated: it was unplugged")
            if begun_s != faults.overflow_at_s:
                yield block._replace(
                    time_s=block.time_s + self._faults.offset_ms / 1000,
                    samples=block.samples * np.int16(not faults.silent),
                    overflowed=number == faults.overflow_at_s * BLOCKS_A_S + 1,
                )


class FaultyDrive(SimulatedDrive):
    def __init__(self, bench, faults):
        super().__init__(bench)
        self._faults = faults

    def query(self):
        state = super().query()
        if self._bench.attempt != 1:
            return state
        is_late = state.time_s - self._bench.roll() >= self._faults.fault_at_s
        speed = state.speed_mm_s * (1 + self._faults.off)
        return state._replace(speed_mm_s=speed, fault="over current" if is_late else None)


def faulty_devices(bench, **faults):
    """Return devices of a dry run with these faults."""
    kinds = FaultyCamera, FaultyMicrophone, FaultyDrive
    return Devices(*(kind(bench, Faults(**faults)) for kind in kinds), bench.clock)

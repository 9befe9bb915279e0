"""The devices of a plan: one clock, opened together, and read each in a thread of its own."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.errors import AfferentsError, InputError
from afferents.lab.devices import base
from afferents.lab.devices.table import CAMERAS, DRIVES, MICROPHONES, make_device
from afferents.lab.recorder.plan import RecordingPlan

SIMULATED = "simulated"
"""Kind of the devices of a dry run."""
PATIENCE_S = 5.0
"""Camera and microphone give something, and end after `end`, within this time, s."""
PLUGGED_IN_S = 60.0
"""A device that went away is waited for this time, s,"""
AGAIN_S = 1.0
"""and tried this often."""


class Clock:
    """The monotonic clock; in a dry run it may go faster.

    Parameters
    ----------
    speed
        How much faster than the machine's it goes; 1 for real devices.
    """

    def __init__(self, speed: float = 1.0) -> None:
        """Begin now."""
        self._begun_s, self._speed = time.monotonic(), speed

    def now(self) -> float:
        """Return the time, s."""
        return self._begun_s + (time.monotonic() - self._begun_s) * self._speed

    def wait(self, seconds: float, ended: threading.Event | None = None) -> bool:
        """Wait this time, or until something has ended; return whether it has."""
        return (ended or threading.Event()).wait(max(0.0, seconds) / self._speed)


@dataclass(frozen=True)
class Devices:
    """What a run is made with; without a microphone there is no sound."""

    camera: base.Camera
    microphone: base.Microphone | None
    drive: base.Drive
    clock: Clock

    @property
    def sound(self) -> base.MicrophoneSettings | None:
        """How the microphone is set; None without one."""
        return self.microphone.settings if self.microphone else None

    @contextmanager
    def stream(
        self,
        take_frame: Callable[[base.Frame], None],
        take_block: Callable[[base.Block], None],
        fail: Callable[[Exception], None],
    ) -> Iterator[None]:
        """Pass on what camera and microphone take, each in a thread, while the block lasts.

        Parameters
        ----------
        take_frame, take_block
            Called with each frame, and each block of sound.
        fail
            Called, in the thread, with an error of the device or of what takes.
        """
        ended = threading.Event()

        def give(name: str, things: Callable[[], Iterator[Any]], take: Any) -> None:
            try:
                for thing in things():
                    if not math.isfinite(thing.time_s):
                        raise base.DeviceError(f"the {name} gave {thing.time_s:g} s for a time")
                    take(thing)
                if not ended.is_set():
                    raise base.DeviceError(f"the {name} gave no more")
            except Exception as error:  # noqa: BLE001  for the reader of the devices
                if not (ended.is_set() and isinstance(error, base.DeviceError)):
                    fail(error)

        streams: list[tuple[Any, ...]] = [("camera", self.camera.frames, take_frame)]
        if self.microphone is not None:
            streams.append(("microphone", self.microphone.blocks, take_block))
        threads = [threading.Thread(target=give, args=one, daemon=True) for one in streams]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            ended.set()
            self.camera.end()
            if self.microphone is not None:
                self.microphone.end()
            for thread in threads:
                thread.join(PATIENCE_S)

    def reopen(self, check: Callable[[], None], note: Callable[[str], object]) -> None:
        """Let go of the devices and open each as soon as it can be: one may have been unplugged.

        Parameters
        ----------
        check
            Called while one is waited for; raises to end that.
        note
            Called with why one can't be opened yet.

        Raises
        ------
        InputError
            If one can't be opened for a minute.
        """
        for device in filter(None, (self.camera, self.microphone, self.drive)):
            device.close()
            latest_s, noted = time.monotonic() + PLUGGED_IN_S, ""
            while True:
                check()
                try:
                    device.open()
                    break
                except AfferentsError as error:
                    if time.monotonic() > latest_s:
                        raise
                    if str(error) != noted:
                        noted = str(error)
                        note(f"{noted}; waiting {PLUGGED_IN_S:g} s at most until it is plugged in")
                time.sleep(AGAIN_S)


def make_devices(plan: RecordingPlan, path: Path) -> Devices:
    """Return the devices that a plan names, unopened.

    Raises
    ------
    InputError
        If a kind or an option is unknown or wrong.
    """
    sound = plan.microphone
    if SIMULATED in {table.get("kind") for table in (plan.camera, sound or {}, plan.drive)}:
        raise InputError(
            f"{path}: expected real devices, found kind = '{SIMULATED}'; give --dry-run, or "
            "name real ones"
        )
    return Devices(
        make_device(CAMERAS, plan.camera, f"{path}, [camera]"),
        None if sound is None else make_device(MICROPHONES, sound, f"{path}, [microphone]"),
        make_device(DRIVES, plan.drive, f"{path}, [drive]"),
        Clock(),
    )


@contextmanager
def open_devices(devices: Devices, plan: RecordingPlan, path: Path) -> Iterator[None]:
    """Open the devices, and let them go whatever happens; the drive stops first.

    Raises
    ------
    InputError
        If one can't be opened or set, or a speed is outside the drive's limits, or the plan wants
        a channel that is not there.
    """
    with ExitStack() as stack:
        stack.enter_context(devices.camera)
        if devices.microphone is not None:
            sound = stack.enter_context(devices.microphone).settings
            channel = plan.sensor_channel
            if channel is not None and channel >= sound.channels:
                raise InputError(
                    f"{path}: expected sensor_channel below {sound.channels}, as the microphone "
                    f"has channels, found {channel}"
                )
        stack.enter_context(devices.drive)
        for speed in plan.speeds_mm_s:
            devices.drive.require_speed(speed)
        yield

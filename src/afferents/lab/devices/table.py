"""Kinds of devices by name; nothing else asks which kind one is."""

from collections.abc import Mapping
from typing import Any, TypeVar

from afferents.documents import as_form
from afferents.errors import InputError
from afferents.lab.devices.base import ByHand, Camera, Device, Drive, Microphone
from afferents.lab.devices.drives.dynamixel import DynamixelDrive
from afferents.lab.devices.drives.growing import GrowingLog
from afferents.lab.devices.drives.serial_drive import SerialDrive
from afferents.lab.devices.portable import PortableCamera
from afferents.lab.devices.portaudio import PortAudioMicrophone
from afferents.lab.devices.v4l2.camera import V4l2Camera

Made = TypeVar("Made", bound=Device)

CAMERAS: dict[str, type[Camera]] = {"v4l2": V4l2Camera, "portable": PortableCamera}
MICROPHONES: dict[str, type[Microphone]] = {"portaudio": PortAudioMicrophone}
DRIVES: dict[str, type[Drive]] = {
    "serial": SerialDrive,
    "dynamixel": DynamixelDrive,
    "csv": GrowingLog,
    "none": ByHand,
}


def make_device(kinds: Mapping[str, type[Made]], table: Mapping[str, Any], where: object) -> Made:
    """Return the device that a table of a plan describes, unopened.

    Parameters
    ----------
    kinds
        `CAMERAS`, `MICROPHONES` or `DRIVES`, perhaps with more.
    table
        ``kind``, and the options of that kind.
    where
        What the table is of, for an error: ``PLAN.toml, [camera]``.

    Raises
    ------
    InputError
        If there is no such kind, or an option is missing, unknown or wrong.

    Examples
    --------
    Your own drive is a class with a form of its options:

    >>> import time
    >>> from afferents.lab.devices import Drive, DriveLimits, DriveState, Options, make_device
    >>> class Belt(Drive):
    ...     class Options(Options):
    ...         kind: str = "belt"
    ...         highest_mm_s: float = 100.0
    ...     def __init__(self, options):
    ...         self.options, self.speed = options, 0.0
    ...     def open(self):
    ...         self.limits = DriveLimits(1.0, self.options.highest_mm_s)
    ...     def start(self, speed_mm_s):
    ...         self.speed = speed_mm_s
    ...     def query(self):
    ...         return DriveState(time.monotonic(), 0.0, self.speed, None)
    ...     def stop(self):
    ...         self.speed = 0.0
    ...     def close(self):
    ...         self.stop()
    >>> with make_device({"belt": Belt}, {"kind": "belt"}, "[drive]") as belt:
    ...     belt.start(20.0)
    ...     belt.read().speed_mm_s
    20.0
    """
    kind = table.get("kind")
    if kind not in kinds:
        found = "none" if kind is None else repr(kind)
        raise InputError(f"{where}: expected kind = one of {', '.join(kinds)}, found {found}")
    made: Any = kinds[str(kind)]
    device: Made = made(as_form(table, made.Options, where, f"options of {kind}"))
    return device

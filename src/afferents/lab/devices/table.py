"""Kinds of devices by name, which nothing else distinguishes; and those that are plugged in."""

import sys
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from afferents import documents, plugins
from afferents.errors import AfferentsError, InputError
from afferents.lab.devices import portable, portaudio, v4l2
from afferents.lab.devices.base import ByHand, Camera, Device, Drive, Microphone
from afferents.lab.devices.drives import dynamixel, growing, serial_drive

Made = TypeVar("Made", bound=Device)

CAMERAS: dict[str, type[Camera]] = {"v4l2": v4l2.V4l2Camera, "portable": portable.PortableCamera}
MICROPHONES: dict[str, type[Microphone]] = {"portaudio": portaudio.PortAudioMicrophone}
DRIVES: dict[str, type[Drive]] = {
    "serial": serial_drive.SerialDrive,
    "dynamixel": dynamixel.DynamixelDrive,
    "csv": growing.GrowingLog,
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
    device: Made = made(documents.as_form(table, made.Options, where, f"options of {kind}"))
    return device


@dataclass(frozen=True)
class FoundCamera:
    """A camera: its path, its name, and what it offers.

    Attributes
    ----------
    lasting
        Its path by what it is, which stays the same when the machine starts again; None where the
        system gives none.
    """

    device: str
    name: str
    modes: tuple[v4l2.Mode, ...]
    lasting: str | None = None


@dataclass(frozen=True)
class FoundMicrophone:
    """A microphone: its number and name, channels, and usual rate."""

    device: str
    name: str
    channels: int
    rate_hz: float


@dataclass(frozen=True)
class FoundPort:
    """A serial port, and what says to be behind it."""

    port: str
    name: str


@dataclass
class Found:
    """What was found, and a sentence for each thing that couldn't be looked at.

    Attributes
    ----------
    drives
        Kinds of drives that can be used, with their templates.
    """

    cameras: list[FoundCamera] = field(default_factory=list)
    microphones: list[FoundMicrophone] = field(default_factory=list)
    ports: list[FoundPort] = field(default_factory=list)
    drives: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def find_devices(folder: Path = Path("/dev")) -> Found:
    """Look at what is plugged in; what can't be looked at becomes a note, and no error.

    Parameters
    ----------
    folder
        Where the system keeps its cameras.
    """
    drives = [*(f"serial ({name})" for name in serial_drive.list_presets()), "dynamixel", "none"]
    found = Found(drives=drives)
    if sys.platform == "linux":
        lasting = {link.resolve(): str(link) for link in (folder / "v4l" / "by-id").glob("*")}
        for path in sorted(folder.glob("video*"), key=lambda path: (len(path.name), path)):
            try:
                with closing(v4l2.Node(str(path))) as node:
                    camera = str(path), node.name, tuple(node.modes()), lasting.get(path.resolve())
                    found.cameras.append(FoundCamera(*camera))
            except AfferentsError as error:
                found.notes.append(str(error))
    else:
        found.notes.append(f"cameras: they can be listed on Linux only, not on {sys.platform}")
    try:
        found.microphones += [
            FoundMicrophone(
                str(number), one["name"], one["max_input_channels"], one["default_samplerate"]
            )
            for number, one in enumerate(portaudio.import_portaudio().query_devices())
            if one["max_input_channels"]
        ]
    except InputError as error:
        found.notes.append(str(error))
    try:
        ports: Any = import_module("serial.tools.list_ports").comports()
        found.ports += [FoundPort(one.device, one.description) for one in sorted(ports)]
    except ImportError:
        found.notes.append(f"serial ports: to see them, {plugins.how_to_install('lab')}")
    return found

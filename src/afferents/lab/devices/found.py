"""What is plugged in: cameras with formats and rates, microphones, serial ports."""

import sys
from contextlib import closing
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from afferents.errors import AfferentsError, InputError
from afferents.lab.devices.drives.template import list_presets
from afferents.lab.devices.portaudio import import_portaudio
from afferents.lab.devices.v4l2.node import Mode, Node
from afferents.plugins import how_to_install


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
    modes: tuple[Mode, ...]
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
    drives = [*(f"serial ({name})" for name in list_presets()), "dynamixel", "none"]
    found = Found(drives=drives)
    if sys.platform == "linux":
        lasting = {link.resolve(): str(link) for link in (folder / "v4l" / "by-id").glob("*")}
        for path in sorted(folder.glob("video*"), key=lambda path: (len(path.name), path)):
            try:
                with closing(Node(str(path))) as node:
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
            for number, one in enumerate(import_portaudio().query_devices())
            if one["max_input_channels"]
        ]
    except InputError as error:
        found.notes.append(str(error))
    try:
        ports: Any = import_module("serial.tools.list_ports").comports()
        found.ports += [FoundPort(one.device, one.description) for one in sorted(ports)]
    except ImportError:
        found.notes.append(f"serial ports: to see them, {how_to_install('lab')}")
    return found

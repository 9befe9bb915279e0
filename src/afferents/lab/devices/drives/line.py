"""A serial line, and the template of what a drive on it says and answers."""

import binascii
import math
import re
import time
from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from afferents.documents import as_form, read_toml
from afferents.errors import InputError, reason_of
from afferents.forms import StrictForm
from afferents.lab.devices.base import DeviceError, not_free
from afferents.plugins import import_extra

ANSWER_S = 0.2
"""An answer takes some ms; of a USB adapter up to 16 more."""
TRIES = 5
"""A line is lost at most so many times in a row before the drive is given up."""


CHECKSUMS: dict[str, Callable[[bytes], int]] = {
    "xor": lambda data: reduce(xor, data, 0),
    "crc16": lambda data: binascii.crc_hqx(data, 0),
}
"""The number after the ``*`` of a line, by its kind. Two like bytes that are lost leave the XOR as
it was, so that 36.4517 and 49.584 may come as 36.517 and 49.58; CRC-16/XMODEM tells them."""


def frame_line(text: str, checksum: str) -> bytes:
    """Return a line as it is sent: with its checksum, if it has one, and its end."""
    data = text.encode("ascii")
    if checksum in CHECKSUMS:
        data += b"*%d" % CHECKSUMS[checksum](data)
    return data + b"\n"


def unframe_line(line: bytes, checksum: str) -> str | None:
    """Return the text of a line that came; None if bytes of it were lost."""
    data = line.strip()
    if checksum in CHECKSUMS:
        data, star, number = data.rpartition(b"*")
        if not star or number != b"%d" % CHECKSUMS[checksum](data):
            return None
    return data.decode("ascii", "replace")


class Line:
    """An open serial port that speaks lines.

    Parameters
    ----------
    port
        Such as ``/dev/ttyACM0`` or ``COM3``.
    baud
        Of the port.
    checksum
        ``crc16``, ``xor`` or ``none``.

    Raises
    ------
    InputError
        If there is no such port, or it is in use.
    """

    def __init__(self, port: str, baud: int, checksum: str) -> None:
        """Open it."""
        serial: Any = import_extra("lab", "a serial drive", "serial")
        self.port, self._checksum, self.asked_s = port, checksum, 0.0
        self._broken = (serial.SerialException, OSError)
        try:
            self._serial = serial.Serial(port, baud, timeout=0.02, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise not_free(f"drive at {port}", "a serial port", error) from error

    @property
    def fd(self) -> int | None:
        """Number of the open port, for another process; None where ports have none."""
        return self._serial.fileno() if hasattr(self._serial, "fd") else None

    def close(self) -> None:
        """Close it; twice is no error."""
        self._serial.close()

    def tell(self, text: str) -> None:
        """Send a line.

        Raises
        ------
        DeviceError
            If the port is gone.
        """
        try:
            self._serial.write(frame_line(text, self._checksum))
        except self._broken as error:
            raise self._lost(reason_of(error).lower()) from error

    def ask(self, text: str, pattern: re.Pattern[str], tries: int = TRIES) -> "re.Match[str]":
        """Send a line until its answer comes whole; `asked_s` is when it was sent last.

        Raises
        ------
        DeviceError
            If the port is gone, or no such answer comes.
        """
        for _ in range(tries):
            try:
                self._serial.reset_input_buffer()
            except Exception as error:  # termios.error is no OSError
                raise self._lost(reason_of(error).lower()) from error
            self.asked_s = time.monotonic()
            self.tell(text)
            found = self._answer(pattern, time.monotonic() + ANSWER_S)
            if found is not None:
                return found
        raise self._lost(f"no answer to '{text}'")

    def _answer(self, pattern: re.Pattern[str], until_s: float) -> "re.Match[str] | None":
        line = b""
        while time.monotonic() < until_s:
            try:
                line += self._serial.readline()
            except self._broken as error:
                raise self._lost(reason_of(error).lower()) from error
            if not line.endswith(b"\n"):
                continue
            text = unframe_line(line, self._checksum)
            found = None if text is None else pattern.search(text)
            if found is not None:
                return found
            line = b""
        return None

    def _lost(self, why: str) -> DeviceError:
        return DeviceError(
            f"drive at {self.port}: lost ({why}); see that the drum stands still, then plug it in"
        )


# What a drive's serial line says and answers: a template in TOML.

PRESETS = Path(__file__).parent / "presets"
GROUPS = {"position", "speed", "fault"}


class Question(StrictForm):
    """A line that is sent, and a regular expression of its answer.

    Attributes
    ----------
    send
        The line.
    reply
        Its groups ``position``, ``speed`` and ``fault`` are what is read.
    """

    send: str
    reply: re.Pattern[str]


class Template(StrictForm):
    """How one make of drives is spoken to.

    Lines may hold ``{value}``: the speed in the drive's unit.

    Attributes
    ----------
    name
        Of the drive, for people.
    baud
        Of the line.
    unit
        Of its positions, and a second of its speeds.
    counts_a_turn
        Of the motor, where the unit is ``count``.
    checksum
        ``xor`` or ``crc16``: each line ends with ``*`` and, as a decimal number, the XOR or the
        CRC-16/XMODEM of the bytes before it.
    open, stop, close
        Lines that set it up, stop it and release it.
    prepare
        Lines before it is started: they clear a fault, and switch it on.
    start
        Lines that give it a speed.
    taken
        Regular expression of the answer to each of these; without, none is waited for.
    read
        Questions, asked in this order.
    no_fault
        What the group ``fault`` holds if there is none.
    no_position
        What the group ``position`` holds before the drive knows it, such as before an index pulse.
    feed
        Lines at each read while it turns: they keep its watchdog quiet, or say its speed again.
    """

    name: str
    baud: Annotated[int, Field(gt=0)] = 115_200
    unit: Literal["mm", "turn", "rad", "deg", "count"] = "mm"
    counts_a_turn: Annotated[float, Field(gt=0)] | None = None
    checksum: Literal["none", "xor", "crc16"] = "none"
    open: tuple[str, ...] = ()
    prepare: tuple[str, ...] = ()
    start: tuple[str, ...] = Field(min_length=1)
    stop: tuple[str, ...] = Field(min_length=1)
    close: tuple[str, ...] = ()
    taken: re.Pattern[str] | None = None
    read: tuple[Question, ...] = Field(min_length=1)
    no_fault: str = "0"
    no_position: str | None = None
    feed: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        groups = {name for question in self.read for name in question.reply.groupindex}
        if "position" not in groups or groups - GROUPS:
            raise ValueError("replies must have a group 'position', may have 'speed', 'fault'")
        if not any("{value}" in line for line in self.start):
            raise ValueError("start must have {value} in it")
        if (self.unit == "count") != (self.counts_a_turn is not None):
            raise ValueError("counts_a_turn goes with the unit count")
        return self

    def mm_a_unit(self, diameter_mm: float | None, gear: float) -> float:
        """Return by how much the drum's surface moves for one unit of the motor, mm.

        Parameters
        ----------
        diameter_mm
            Of the drum; needed unless the drive counts mm itself.
        gear
            Turns of the motor for one of the drum.

        Raises
        ------
        InputError
            If the diameter is missing.
        """
        if self.unit == "mm":
            return 1.0
        if diameter_mm is None:
            raise InputError(
                f"[drive]: expected diameter_mm, since {self.name} counts in units of "
                f"{self.unit}, found none"
            )
        a_turn = {"turn": 1.0, "rad": math.tau, "deg": 360.0, "count": self.counts_a_turn or 1.0}
        return math.pi * diameter_mm / gear / a_turn[self.unit]


def list_presets() -> list[str]:
    """Return the names of the templates that come with the package."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def read_template(name: str) -> Template:
    """Return a preset by its name, or the template in a TOML file.

    Raises
    ------
    InputError
        If there is none, or it is wrong.
    """
    path = Path(name) if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not name.endswith(".toml") and name not in list_presets():
        found = f"'{name}'"
        raise InputError(
            f"template: expected a TOML file, or one of {', '.join(list_presets())}, found {found}"
        )
    what = "a drive's template"
    return as_form(read_toml(path, what), Template, path, what)

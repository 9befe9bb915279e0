"""A drive on a serial line: a template says what it hears and answers, a port speaks its lines."""

import atexit
import binascii
import math
import re
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from afferents import documents, forms, plugins
from afferents.errors import InputError, reason_of
from afferents.lab.devices import base
from afferents.lab.devices.drives.guard import Guard

PRESETS = Path(__file__).parent / "presets"
GROUPS = {"position", "speed", "fault"}
STOPS = 3
"""How often a stop is sent where no answer confirms it."""
ANSWER_S = 0.2
"""An answer takes some ms; of a USB adapter up to 16 more."""
TRIES = 5
"""A drive is given up when its answer is lost this many times in a row."""
CHECKSUMS: dict[str, Callable[[bytes], int]] = {
    "xor": lambda data: reduce(xor, data, 0),
    "crc16": lambda data: binascii.crc_hqx(data, 0),
}
"""The number after the ``*`` of a line, by its kind. Two like bytes that are lost leave the XOR as
it was, so that 36.4517 and 49.584 may come as 36.517 and 49.58; CRC-16/XMODEM finds it."""

Amount = Annotated[float, Field(gt=0, lt=1e6)]


class Question(forms.StrictForm):
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


class Template(forms.StrictForm):
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
        Questions, sent in this order.
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
    def _require_consistent(self) -> Self:
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
    path, what = Path(name), "a drive's template"
    if path.suffix != ".toml":
        path = PRESETS / f"{name}.toml"
        if name not in list_presets():
            known = ", ".join(list_presets())
            raise InputError(f"template: expected a TOML file, or one of {known}, found '{name}'")
    return documents.as_form(documents.read_toml(path, what), Template, path, what)


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
        serial: Any = plugins.import_extra("lab", "a serial drive", "serial")
        self.port, self._checksum, self.sent_s = port, checksum, 0.0
        try:
            self._serial = serial.Serial(port, baud, timeout=0.02, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise base.not_free(f"drive at {port}", "a serial port", error) from error

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
        with self._reporting_loss():
            self._serial.write(frame_line(text, self._checksum))

    def ask(self, text: str, pattern: re.Pattern[str], tries: int = TRIES) -> "re.Match[str]":
        """Send a line until its answer comes whole; `sent_s` is when it was sent last.

        Raises
        ------
        DeviceError
            If the port is gone, or no such answer comes.
        """
        for _ in range(tries):
            with self._reporting_loss():
                self._serial.reset_input_buffer()
            self.sent_s, received = time.monotonic(), b""
            self.tell(text)
            until_s = time.monotonic() + ANSWER_S
            while time.monotonic() < until_s:
                with self._reporting_loss():
                    received += self._serial.readline()
                if received.endswith(b"\n"):
                    answer = unframe_line(received, self._checksum)
                    if answer is not None and (found := pattern.search(answer)):
                        return found
                    received = b""
        raise self._lost(f"no answer to '{text}'")

    @contextmanager
    def _reporting_loss(self) -> Iterator[None]:
        """Report that the port is gone, whatever it raises: termios.error is no OSError."""
        try:
            yield
        except Exception as error:
            raise self._lost(reason_of(error).lower()) from error

    def _lost(self, why: str) -> base.DeviceError:
        return base.DeviceError(
            f"drive at {self.port}: lost ({why}); see that the drum stands still, then plug it in"
        )


class SerialOptions(base.Options):
    """A drive on a serial line.

    Attributes
    ----------
    port
        Such as ``/dev/ttyACM0`` or ``COM3``.
    template
        A preset, or your own TOML file.
    baud
        Another speed of the line than the template's.
    diameter_mm
        Of the drum, where the drive counts turns.
    gear
        Turns of the motor for one of the drum.
    reversed
        Whether the drum turns the other way.
    lowest_mm_s, highest_mm_s
        Speeds that it can hold.
    wait_s
        How long it may take to answer first: many boards restart when their port is opened.
    """

    kind: Literal["serial"] = "serial"
    port: str
    template: str
    baud: Annotated[int, Field(gt=0)] | None = None
    diameter_mm: Amount | None = None
    gear: Amount = 1.0
    reversed: bool = False
    lowest_mm_s: Annotated[float, Field(ge=0)] = 1.0
    highest_mm_s: Amount = 200.0
    wait_s: Annotated[float, Field(ge=0, le=60)] = 5.0


class SerialDrive(base.Drive):
    """A drive on a serial line; reading it keeps it turning."""

    Options = SerialOptions

    def __init__(self, options: SerialOptions) -> None:
        """Read the template; touch nothing yet.

        Raises
        ------
        InputError
            If the template is missing or wrong, or needs the drum's diameter.
        """
        self.options = options
        self.template = read_template(options.template)
        sign = -1.0 if options.reversed else 1.0
        self._mm = sign * self.template.mm_a_unit(options.diameter_mm, options.gear)
        if options.lowest_mm_s >= options.highest_mm_s:
            raise InputError(
                f"[drive]: expected highest_mm_s above lowest_mm_s ({options.lowest_mm_s:g}), "
                f"found {options.highest_mm_s:g}"
            )
        self._line: Line | None = None
        self._guard = Guard(None, b"")
        self._turning, self._value = False, "0"
        # Read in one thread, stopped from another: one speaks on the line at a time.
        self._speaking = threading.RLock()

    def open(self) -> None:
        """Open the port, prepare the drive, and see that it answers.

        Raises
        ------
        InputError
            If there is no such port, it is in use, or what is there does not answer.
        """
        options, template = self.options, self.template
        self._line = Line(options.port, options.baud or template.baud, template.checksum)
        self.limits = base.DriveLimits(options.lowest_mm_s, options.highest_mm_s)
        atexit.register(self.stop)
        try:
            first = template.read[0]
            self._line.ask(first.send, first.reply, tries=1 + round(options.wait_s / ANSWER_S))
            stop = b"".join(frame_line(line, template.checksum) for line in template.stop)
            self._guard = Guard(self._line.fd, stop)
            self._say(template.open)
            self._say(template.stop)
            self._measured = base.SpeedFromPosition()
            state = self.query()
            if why := self.limits.find_impossible(state):
                raise base.DeviceError(state.fault or why)
        except base.DeviceError as error:
            self.close()
            raise InputError(
                f"drive at {options.port}: expected one that speaks as {template.name}, found "
                f"none that answers so ({error}); look at its port, power, baud and template"
            ) from error
        except BaseException:
            self.close()
            raise

    def start(self, speed_mm_s: float) -> None:
        """Turn at this speed."""
        self.require_speed(speed_mm_s)
        with self._speaking:
            self._turning = True
            self._guard.beat(self._turning)
            self._say(self.template.prepare)
            self._value = f"{speed_mm_s / self._mm:.5f}"
            self._say([line.replace("{value}", self._value) for line in self.template.start])

    def query(self) -> base.DriveState:
        """Return its state; feed its watchdog."""
        with self._speaking:
            self._guard.beat(self._turning)
            line = self._require_line()
            if self._turning:
                for text in self.template.feed:
                    line.tell(text.replace("{value}", self._value))
            found: dict[str, str] = {}
            for question in self.template.read:
                groups = line.ask(question.send, question.reply).groupdict()
                if "position" in groups:
                    time_s = (line.sent_s + time.monotonic()) / 2
                found |= groups
            return self._interpret(found, time_s)

    def stop(self) -> None:
        """Stop the drum; never raises."""
        self._turning = False
        if self._line is not None:
            with suppress(Exception):  # at once, even while another thread speaks
                for text in self.template.stop:
                    self._line.tell(text)
            with self._speaking:
                for _ in range(1 if self.template.taken else STOPS):
                    with suppress(Exception):
                        self._say(self.template.stop)
        self._guard.beat(False)

    def close(self) -> None:
        """Stop the drum and let the port go."""
        self.stop()
        atexit.unregister(self.stop)
        if self._line is not None:
            with suppress(Exception):
                self._say(self.template.close)
            self._line.close()
            self._line = None
        self._guard.close()

    def _require_line(self) -> Line:
        if self._line is None:
            raise base.DeviceError(f"drive at {self.options.port}: it is not open")
        return self._line

    def _say(self, lines: Sequence[str]) -> None:
        line = self._require_line()
        for text in lines:
            if self.template.taken is None:
                line.tell(text)
            else:
                line.ask(text, self.template.taken)

    def _interpret(self, found: dict[str, str], time_s: float) -> base.DriveState:
        position_mm = speed_mm_s = None
        try:
            if found["position"] != self.template.no_position:
                position_mm = float(found["position"]) * self._mm
                if math.isfinite(position_mm):
                    speed_mm_s = self._measured.read(time_s, position_mm)
            if "speed" in found:
                speed_mm_s = float(found["speed"]) * self._mm
        except ValueError as error:
            why = f"no number: {re.sub(r'.*: ', '', str(error))}; correct the template"
            return base.DriveState(time_s, math.nan, math.nan, f"impossible answer: {why}")
        fault = found.get("fault")
        fault = None if fault == self.template.no_fault else fault
        return base.DriveState(time_s, position_mm, speed_mm_s, fault)

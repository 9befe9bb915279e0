"""A drive on a serial line, spoken to by a template."""

import atexit
import math
import re
import threading
import time
from contextlib import suppress
from typing import Annotated, Literal

from pydantic import Field

from afferents.errors import InputError
from afferents.lab.devices import base
from afferents.lab.devices.base import DeviceError, DriveLimits, DriveState
from afferents.lab.devices.drives.guard import Guard
from afferents.lab.devices.drives.line import ANSWER_S, Line, frame_line
from afferents.lab.devices.drives.template import read_template

STOPS = 3
"""How often a stop is sent where no answer confirms it."""

Amount = Annotated[float, Field(gt=0, lt=1e6)]


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
        self.limits = DriveLimits(options.lowest_mm_s, options.highest_mm_s)
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
                raise DeviceError(state.fault or why)
        except DeviceError as error:
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

    def query(self) -> DriveState:
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
            raise DeviceError(f"drive at {self.options.port}: it is not open")
        return self._line

    def _say(self, lines: list[str] | tuple[str, ...]) -> None:
        line = self._require_line()
        for text in lines:
            if self.template.taken is None:
                line.tell(text)
            else:
                line.ask(text, self.template.taken)

    def _interpret(self, found: dict[str, str], time_s: float) -> DriveState:
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
            return DriveState(time_s, math.nan, math.nan, f"impossible answer: {why}")
        fault = found.get("fault")
        fault = None if fault == self.template.no_fault else fault
        return DriveState(time_s, position_mm, speed_mm_s, fault)

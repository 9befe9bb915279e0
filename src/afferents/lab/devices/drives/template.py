"""What a drive's serial line says and answers: a template in TOML."""

import math
import re
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from afferents.documents import as_form, read_toml
from afferents.errors import InputError
from afferents.forms import StrictForm

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
    path = Path(name) if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not name.endswith(".toml") and name not in list_presets():
        known = ", ".join(list_presets())
        raise InputError(f"template: expected a TOML file, or one of {known}, found '{name}'")
    what = "a drive's template"
    return as_form(read_toml(path, what), Template, path, what)

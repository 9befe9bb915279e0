"""What is held out: by what recordings form groups, of which one is held out at a time.

A `Split` knows how a recording's group is read, how it is printed, and what it is called in the
files of a results folder. There are three kinds: by speed, which is the default, by a condition
that recordings carry (`trial`, `repetition`, `pressure`, ...), and by the arc of the drum that was
touched, which goes through every recording.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.responses import Responses, conditions, speed_of
from afferents.core.samples import Samples
from afferents.core.split_angle import ANGLE, ByAngle
from afferents.core.split_base import OPTION, Group, Split, group_in, key_of, order

__all__ = [
    "NAME",
    "OPTION",
    "SPEED",
    "TEXTURE",
    "Group",
    "Split",
    "column_of",
    "folder_name",
    "group_in",
    "key_of",
    "order",
    "split_named",
    "split_of",
]

TEXTURE = "texture"
"""Held out as well as a speed; another evaluation, with questions of its own."""
NAME = r"\w[\w .+-]*"
"""Of a condition."""
_LONGEST = 80
"""Characters of a group: a folder is named by it."""


class _BySpeed(Split):
    """By the sliding speed, mm/s: a model is asked at a speed that it has never felt."""

    ordered = True
    coordinate, column = dims.SPEED, "held_out_speed_mm_s"
    held_out, validation, groups = "held_out_mm_s", "validation_mm_s", "speeds_mm_s"
    by, worst, validations = "by_speed", "worst_speed", "validation_speeds"
    leaks = "speed"

    @property
    def one(self) -> str:
        return "a speed"

    @property
    def many(self) -> str:
        return "speeds"

    @property
    def axis(self) -> str:
        return "speed (mm/s)"

    @property
    def unit(self) -> str:
        return " mm/s"

    def at(self, groups: Sequence[Group]) -> str:
        return f"at {', '.join(map(key_of, groups))}{self.unit}"

    def printed(self, group: Group) -> str:
        return f"{key_of(group)}{self.unit}"

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        found: set[Group] = set()
        for responses in recordings:
            speed = speed_of(responses)
            if speed is None:
                name = responses.attrs["name"]
                do = "hold out something else, such as --split trial"
                raise InputError(OPTION, "the speed of every recording", f"none of {name}", do)
            found.add(speed)
        return sorted(found, key=order)

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        return samples

    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        try:
            return tuple(float(speed) for speed in wanted)
        except (TypeError, ValueError):
            raise InputError(option, "speeds in mm/s", f"{wanted!r}") from None


class _ByCondition(Split):
    """By a condition of recordings: a model is asked in a trial, say, that it has never felt."""

    ordered = False
    coordinate, column = dims.GROUP, "held_out_group"
    held_out, validation, groups = "held_out_group", "validation_group", "groups"
    by, worst, validations = "by_group", "worst_group", "validation_groups"
    leaks = "group"

    @property
    def one(self) -> str:
        return f"{'an' if self.name[:1].lower() in 'aeiou' else 'a'} {self.name}"

    @property
    def many(self) -> str:
        return f"values of {self.name}"

    def at(self, groups: Sequence[Group]) -> str:
        return f"with {self.name} {', '.join(map(key_of, groups))}"

    def printed(self, group: Group) -> str:
        return self.named(group)

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        return sorted(set(self._by_recording(recordings).values()), key=order)

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        group = self._by_recording(recordings)
        names = samples[dims.RECORDING].values
        of_samples = np.array([group[str(name)] for name in names], dtype=np.str_)
        return samples.assign_coords({self.coordinate: (dims.SAMPLE, of_samples)})

    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        return tuple(map(_text, wanted))

    def _by_recording(self, recordings: Iterable[Responses]) -> dict[str, str]:
        """Return the groups of recordings by their names."""
        declared = {str(r.attrs["name"]): conditions(r) for r in recordings}
        lacking = [name for name, its in declared.items() if self.name not in its]
        if lacking:
            shared = set.intersection(*(set(its) for its in declared.values()))
            raise InputError(
                OPTION,
                "'speed', 'texture', 'angle', or a condition that all recordings carry "
                f"({', '.join(sorted(shared)) or 'none'})",
                f"'{self.name}', which {_some(lacking, len(declared))}",
            )
        found = {name: _text(its[self.name]) for name, its in declared.items()}
        for name, group in found.items():
            if not 0 < len(group) <= _LONGEST:
                expected = f"a {self.name} of 1 to {_LONGEST} characters"
                raise InputError(f"recording {name}", expected, f"'{group[:_LONGEST]}'")
        return found


def _some(lacking: Sequence[str], n: int) -> str:
    """Return in words which recordings lack a condition."""
    if len(lacking) == n:
        return "none has"
    others = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
    return f"{lacking[0]}{others} of {n} {'lack' if others else 'lacks'}"


SPEED: Split = _BySpeed("speed")
"""The default: one speed is held out at a time."""


def split_named(name: str) -> Split:
    """Return what is held out under a name: `speed`, `angle` (`angle-8`), or a condition's.

    Raises
    ------
    InputError
        If it is none.
    """
    if name == SPEED.name:
        return SPEED
    if name == TEXTURE:
        do = "from Python call evaluate_textures for it"
        raise InputError(OPTION, "'speed' or a condition", f"'{TEXTURE}'", do)
    if re.fullmatch(rf"{ANGLE}(-\d+)?", name):
        return ByAngle(name)
    if not re.fullmatch(NAME, name):
        expected = "'speed', 'texture', 'angle' or a condition of the recordings, such as trial"
        raise InputError(OPTION, expected, f"'{name}'")
    return _ByCondition(name)


def split_of(document: Mapping[str, Any]) -> Split:
    """Return the split that a configuration or a summary is of; earlier ones name none."""
    return split_named(document.get("split", SPEED.name))


def column_of(table: Any) -> str:
    """Return the name of the column that says what a table's rows were held out with."""
    return SPEED.column if SPEED.column in table else _ByCondition.column


def folder_name(group: Group) -> str:
    """Return a name of a folder that no other group has, nor a mark beside it."""
    if not isinstance(group, str):
        return key_of(group)
    return re.sub(r"[^\w +=-]", lambda found: _percent(found.group()), group)


def _percent(character: str) -> str:
    return "".join(f"%{byte:02X}" for byte in character.encode("utf-8", "surrogatepass"))


def _text(value: Any) -> str:
    """Return the value of a condition as text: 1, 1.0 and ``1`` are the same trial."""
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 1e15
    return str(int(value)) if whole else str(value).strip()

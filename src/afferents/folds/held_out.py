"""What is held out: by what recordings form groups, of which one is held out at a time.

A `Split` knows how a recording's group is read, how it is printed, and what it is called in the
files of a results folder. Here are three kinds: by speed, which is the default, by a condition
that recordings carry (`trial`, `repetition`, `pressure`, ...), and by a pair of these. Two divide
recordings: `arcs`, by the arc of the drum that was touched, and `bands`, by speed or force.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.errors import InputError, then
from afferents.store import motion, recording
from afferents.store.responses import Responses, conditions, speed_of

Group = float | str
"""A speed, mm/s, the value of a condition as text, or the number of an arc as text."""

OPTION = "--split"
NAME = r"\w[\w .+-]*"
"""Of a condition."""
_LONGEST = 80
"""Characters of a group: a folder is named by it."""
_OF_PAIR = "/"
"""Stands between the two of a cell."""
_ALIKE = 0.02
"""Speeds closer than this share of one another count as one: to learn from one is to see both."""

GroupName = Annotated[str, Field(min_length=1)]
SplitName = Annotated[str, Field(pattern=f"^{NAME}(,{NAME})?$")]


class Split:
    """By what recordings form groups: a condition that they carry, unless a subclass overrides it.

    A model is tested on a trial, for example, that it has not learnt from.

    Attributes
    ----------
    name
        In commands and files.
    title, one, many, axis
        What a group is, in words: without an article, with it, several, and with its unit as an
        axis has it.
    ordered
        Whether groups lie on a scale, so that some are between others.
    whole
        Whether a recording is of one group; else its samples are of several, or of none.
    coordinate
        Of samples, on `sample`: their groups.
    column
        Of tables of predictions: the group held out.
    groups
        Key of the groups in `summary.json`.
    leaks
        What a leak is counted by, in the names of leaks.
    unit
        Of the groups, with a space before it; none where they have none.
    divided
        What is divided into groups where recordings are not whole, in words.
    printed_as, at_as
        What `printed` and `at` fill in.
    """

    ordered, whole = False, True
    coordinate, column = dims.GROUP, "held_out_group"
    groups, leaks = "groups", "group"
    unit = divided = ""

    def __init__(self, name: str) -> None:
        """Set the words for a condition of that name."""
        self.name = self.title = self.axis = name
        self.one = f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
        self.many = f"values of {name}"
        self.printed_as, self.at_as = f"{name} {{}}", f"with {name} {{}}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Split) and self.name == other.name

    def __hash__(self) -> int:
        return hash(self.name)

    def settled(self, recordings: Sequence[Responses]) -> "Split":
        """Return it with what its groups take from the recordings that are used."""
        return self

    def at(self, groups: Sequence[Group]) -> str:
        """Return where something was, in words: `at 10, 20 mm/s`, `with trial 1`."""
        return self.at_as.format(", ".join(map(key_of, groups)))

    def printed(self, group: Group) -> str:
        """Return a group in words: `10 mm/s`, `trial 1`."""
        return self.printed_as.format(key_of(group))

    def named(self, group: Group) -> str:
        """Return a group with the name of what it is: `speed 10 mm/s`, `trial 1`."""
        return f"{self.name} {self.printed(group)}" if self.ordered else self.printed(group)

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        """Return the groups that recordings are of, each once, in order.

        Raises
        ------
        InputError
            If there is a recording that is of none.
        """
        return sorted(set(self.by_recording(recordings).values()), key=order)

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        """Return samples of these recordings with their groups on `coordinate`."""
        group = self.by_recording(recordings)
        names = samples[dims.RECORDING].values
        of_samples = np.array([group[str(name)] for name in names], dtype=np.str_)
        return samples.assign_coords({self.coordinate: (dims.SAMPLE, of_samples)})

    def of(self, samples: Samples) -> NDArray[Any]:
        """Return the groups of samples, (n_samples,)."""
        return np.asarray(samples[self.coordinate].values)

    def sharing(self, groups: NDArray[Any], group: Group) -> NDArray[np.bool_]:
        """Return which of these groups nothing is learnt from where a group is held out."""
        return np.asarray(groups == group)

    def require(self, wanted: Iterable[Group], there: Collection[Group], option: str) -> None:
        """Refuse groups that an option names and no recording is of.

        Raises
        ------
        InputError
            If there is one.
        """
        expected = f"some of {', '.join(map(key_of, there))}{self.unit}"
        expected = expected if there else f"recordings whose {self.name} is known"
        for group in wanted:
            if group not in there:
                raise InputError(f"{option}: expected {expected}, found {key_of(group)}")

    def by_recording(self, recordings: Iterable[Responses]) -> Mapping[str, Group]:
        """Return the groups of recordings by their names; of recordings that are divided none.

        Raises
        ------
        InputError
            As `groups_of`.
        """
        if not self.whole:
            return {str(responses.attrs["name"]): "" for responses in recordings}
        declared = {str(r.attrs["name"]): conditions(r) for r in recordings}
        lacking = [name for name, its in declared.items() if self.name not in its]
        if lacking:
            shared = set.intersection(*(set(its) for its in declared.values()))
            raise InputError(
                f"{OPTION}: expected 'speed', 'texture', 'angle', or a condition that all "
                f"recordings carry ({', '.join(sorted(shared)) or 'none'}), found '{self.name}', "
                f"which {len(lacking)} of {len(declared)} lack, such as {lacking[0]}"
            )
        found = {name: condition_text(its[self.name]) for name, its in declared.items()}
        for name, group in found.items():
            if not 0 < len(group) <= _LONGEST:
                expected = f"a {self.name} of 1 to {_LONGEST} characters"
                raise InputError(
                    f"recording {name}: expected {expected}, found '{group[:_LONGEST]}'"
                )
        return found


class _BySpeed(Split):
    """By the sliding speed, mm/s: a model is tested at a speed that it has not learnt from."""

    ordered = True
    coordinate, column = dims.SPEED, "held_out_speed_mm_s"
    groups, leaks, unit = "speeds_mm_s", "speed", " mm/s"

    def __init__(self) -> None:
        super().__init__("speed")
        self.many, self.axis = "speeds", "speed (mm/s)"
        self.printed_as, self.at_as = "{} mm/s", "at {} mm/s"

    def by_recording(self, recordings: Iterable[Responses]) -> Mapping[str, Group]:
        found: dict[str, Group] = {}
        for responses in recordings:
            name, speed = str(responses.attrs["name"]), speed_of(responses)
            if speed is None:
                do = "give it in the session (speed_mm_s) and extract again, or hold out something "
                do += "else, such as --split trial"
                if motion.has_speed(responses):
                    do = "it changes within the recording: hold out bands of it, as --bands 20,40"
                raise InputError(
                    f"{OPTION}: expected the speed of every recording, found none of "
                    f"{name}{then(do)}"
                )
            found[name] = speed
        return found

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        groups = super().groups_of(recordings)
        for slow, fast in pairwise(float(group) for group in groups):
            if fast - slow < _ALIKE * fast:
                raise InputError(
                    f"{OPTION}: expected speeds that differ by {_ALIKE:.0%} or more, found "
                    f"{slow:g} and {fast:g} mm/s: to learn from one is to see the other; declare "
                    "the same speed_mm_s for both, or leave one out with --speeds"
                )
        return groups

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        return samples


SPEED: Split = _BySpeed()
"""The default: one speed is held out at a time."""


class ByPair(Split):
    """By two at once, such as `speed,force`: what is tested shares neither with what is learnt.

    A group is a cell of their table, `20/F100`. Learnt from are the cells of other rows and other
    columns; the rest of the row and the column that cross in the cell is left out.

    Attributes
    ----------
    both
        What each of the two holds out.
    """

    def __init__(self, name: str) -> None:
        """Set the words: `pairs of speed and force`, `speed (mm/s) / force`."""
        super().__init__(name)
        one, _, other = name.partition(",")
        self.both = split_named(one), split_named(other)
        names = " and ".join(each.name for each in self.both)
        self.one, self.many = f"a pair of {names}", f"pairs of {names}"
        self.axis = " / ".join(each.axis for each in self.both)

    def at(self, groups: Sequence[Group]) -> str:
        """Return `with speed 20 mm/s and force F100`."""
        return f"with {'; '.join(map(self.printed, groups))}"

    def printed(self, group: Group) -> str:
        """Return `speed 20 mm/s and force F100`."""
        each = zip(self.both, str(group).split(_OF_PAIR, 1), strict=True)
        return " and ".join(split.named(part) for split, part in each)

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        """Return the cells that recordings are of; as `Split.groups_of`, of each of the two."""
        there = list(recordings)
        for each in self.both:
            each.groups_of(there)  # refuses what can't be held out alone
        return super().groups_of(there)

    def sharing(self, groups: NDArray[Any], group: Group) -> NDArray[np.bool_]:
        """Return which of these cells are of the row or the column of a cell."""
        row, _, column = str(group).partition(_OF_PAIR)
        parts = np.array([str(each).split(_OF_PAIR, 1) for each in groups]).reshape(-1, 2)
        return np.asarray((parts[:, 0] == row) | (parts[:, 1] == column))

    def by_recording(self, recordings: Iterable[Responses]) -> Mapping[str, Group]:
        """Return the cells of recordings by their names.

        Raises
        ------
        InputError
            If there is a recording that has not both, or a name of a row has a slash.
        """
        there = list(recordings)
        rows, columns = (each.by_recording(there) for each in self.both)
        if slashed := [str(row) for row in rows.values() if _OF_PAIR in key_of(row)]:
            expected = f"values of {self.both[0].name} without '{_OF_PAIR}'"
            raise InputError(f"{OPTION}: expected {expected}, found '{slashed[0]}'")
        return {name: f"{key_of(rows[name])}{_OF_PAIR}{key_of(columns[name])}" for name in rows}


def key_of(group: Group) -> str:
    """Return a group as the key of a table: ``10``, ``12.5``, ``F250``."""
    return group if isinstance(group, str) else f"{group:g}"


def group_in(value: object) -> Group:
    """Return a group as a cell or a key of a pandas table holds it."""
    return value if isinstance(value, str) else float(str(value))


def order(group: Group) -> tuple[float, str]:
    """Sort key: numbers by value, then words alphabetically."""
    if not isinstance(group, str):
        return (float(group), "")
    value, _ = recording.natural_order(group)
    return (value, group)


def keep_parts(
    split: Split, samples: Samples, parts: NDArray[np.str_], groups: Sequence[Group], wider: str
) -> Samples:
    """Return the samples that are of a group, where recordings are divided into groups.

    Parameters
    ----------
    parts
        The group of each sample; empty for those that are of none.
    groups
        All that there are.
    wider
        What makes groups wider, apart from shorter windows and longer recordings.

    Raises
    ------
    InputError
        If a texture has no sample in some group, where it would not be tested.
    """
    whole = samples.assign_coords({split.coordinate: (dims.SAMPLE, parts)})
    kept = whole.isel({dims.SAMPLE: np.flatnonzero(parts != "")})
    textures, its = kept[dims.TEXTURE].values, kept[split.coordinate].values
    for texture in np.unique(textures):
        there = set(its[textures == texture].tolist())
        for group in groups:
            if group not in there:
                raise InputError(
                    f"{OPTION}: expected samples of every texture in every group, found none of "
                    f"{texture} in {split.printed(group)}; take shorter windows (--window-s), "
                    f"{wider}, or record for longer"
                )
    return kept


def split_named(name: str) -> Split:
    """Return what is held out under a name: `speed`, `angle` (`angle-8`), a condition's, or a pair.

    Raises
    ------
    InputError
        If it is none.
    """
    if name == SPEED.name:
        return SPEED
    from afferents.folds import arcs, bands  # which are made of this module's splits

    if arcs.NAME.fullmatch(name):
        return arcs.ByAngle(name)
    if bands.NAME.fullmatch(name):
        return bands.ByBand(name)
    if re.fullmatch(rf"{NAME},{NAME}", name):
        pair = ByPair(name)
        if len(set(pair.both)) < 2 or not all(each.whole for each in pair.both):
            expected = "two different ones of 'speed' and conditions of the recordings"
            raise InputError(f"{OPTION}: expected {expected}, found '{name}'")
        return pair
    if name == dims.TEXTURE or not re.fullmatch(NAME, name):
        expected = "'speed', 'angle' or a condition of the recordings, such as trial"
        raise InputError(f"{OPTION}: expected {expected}, found '{name}'")
    return Split(name)


def column_of(table: Any) -> str:
    """Return the name of a table's column of what was held out."""
    return SPEED.column if SPEED.column in table else Split.column


def folder_name(group: Group) -> str:
    """Return a name of a folder that no other group has, nor a mark next to it."""
    if not isinstance(group, str):
        return key_of(group)
    return re.sub(
        r"[^\w +=-]",
        lambda found: "".join(f"%{b:02X}" for b in found[0].encode("utf-8", "surrogatepass")),
        group,
    )


def condition_text(value: Any) -> str:
    """Return the value of a condition as text: 1, 1.0 and ``1`` are the same trial."""
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 1e15
    return str(int(value)) if whole else str(value).strip()

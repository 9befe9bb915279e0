"""What is held out: by what recordings form groups, of which one is held out at a time.

A `Split` knows how a recording's group is read, how it is printed, and what it is called in the
files of a results folder. There are four kinds: by speed, which is the default, by a condition
that recordings carry (`trial`, `repetition`, `pressure`, ...), by a pair of these, and by the arc
of the drum that was touched, which goes through every recording.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.errors import InputError, then
from afferents.store.drum_path import LONGEST_GAP_MM, MARK, DrumPath, path_in
from afferents.store.motion import has_speed
from afferents.store.recording import natural_order
from afferents.store.responses import Responses, conditions, speed_of, steady_s

Group = float | str
"""A speed, mm/s, the value of a condition as text, or the number of an arc as text."""

OPTION = "--split"
NAME = r"\w[\w .+-]*"
"""Of a condition."""
_LONGEST = 80
"""Characters of a group: a folder is named by it."""
_ALIKE = 0.02
"""Speeds closer than this share of one another count as one: who learns one has seen both."""

# What numbers and names in our files may be.

Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0)]
Amount = Annotated[float, Field(ge=0)]
Speed = Annotated[float, Field(gt=0)]
Shares = tuple[Share, Share]
GroupName = Annotated[str, Field(min_length=1)]
SplitName = Annotated[str, Field(pattern=f"^{NAME}(,{NAME})?$")]
Steady = tuple[Amount, Amount]


@dataclass(frozen=True)
class Split:
    """By what recordings form groups: a condition that they carry, unless a subclass says else.

    A model is asked in a trial, say, that it has never felt.

    Attributes
    ----------
    name
        In commands and files.
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
    """

    name: str

    ordered: ClassVar[bool] = False
    whole: ClassVar[bool] = True
    coordinate: ClassVar[str] = dims.GROUP
    column: ClassVar[str] = "held_out_group"
    groups: ClassVar[str] = "groups"
    leaks: ClassVar[str] = "group"
    unit: ClassVar[str] = ""
    divided: ClassVar[str] = ""

    @property
    def title(self) -> str:
        """What a group is, in words without an article."""
        return self.name

    def settled(self, recordings: Sequence[Responses]) -> "Split":
        """Return it with what its groups take from the recordings that are used."""
        return self

    @property
    def one(self) -> str:
        """A group, in words, with its article."""
        return f"{'an' if self.title[:1].lower() in 'aeiou' else 'a'} {self.title}"

    @property
    def many(self) -> str:
        """Groups, in words."""
        return f"values of {self.name}"

    @property
    def axis(self) -> str:
        """What groups are, with their unit, as an axis says it."""
        return self.name

    def at(self, groups: Sequence[Group]) -> str:
        """Return where something was, in words: `at 10, 20 mm/s`, `with trial 1`."""
        return f"with {self.name} {', '.join(map(key_of, groups))}"

    def printed(self, group: Group) -> str:
        """Return a group in words: `10 mm/s`, `trial 1`."""
        return f"{self.name} {key_of(group)}"

    def named(self, group: Group) -> str:
        """Return a group with the name of what it is: `speed 10 mm/s`, `trial 1`."""
        return self.printed(group)

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

    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        """Return groups as somebody names them.

        Raises
        ------
        InputError
            Naming the option, if one can't be one.
        """
        return tuple(map(text_of, wanted))

    def of(self, samples: Samples) -> NDArray[Any]:
        """Return the groups of samples, (n_samples,)."""
        return np.asarray(samples[self.coordinate].values)

    def sharing(self, groups: NDArray[Any], group: Group) -> NDArray[np.bool_]:
        """Return which of these groups nothing is learnt from where a group is held out."""
        return np.asarray(groups == group)

    def require(self, wanted: Iterable[Group], there: Collection[Group], option: str) -> None:
        """Refuse groups that an option asks for and no recording is of.

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
        """Return the groups of recordings by their names.

        Raises
        ------
        InputError
            As `groups_of`.
        """
        declared = {str(r.attrs["name"]): conditions(r) for r in recordings}
        lacking = [name for name, its in declared.items() if self.name not in its]
        if lacking:
            shared = set.intersection(*(set(its) for its in declared.values()))
            raise InputError(
                f"{OPTION}: expected 'speed', 'texture', 'angle', or a condition that all "
                f"recordings carry ({', '.join(sorted(shared)) or 'none'}), found '{self.name}', "
                f"which {len(lacking)} of {len(declared)} lack, such as {lacking[0]}"
            )
        found = {name: text_of(its[self.name]) for name, its in declared.items()}
        for name, group in found.items():
            if not 0 < len(group) <= _LONGEST:
                expected = f"a {self.name} of 1 to {_LONGEST} characters"
                raise InputError(
                    f"recording {name}: expected {expected}, found '{group[:_LONGEST]}'"
                )
        return found


class _BySpeed(Split):
    """By the sliding speed, mm/s: a model is asked at a speed that it has never felt."""

    ordered = True
    coordinate, column = dims.SPEED, "held_out_speed_mm_s"
    groups, leaks, unit = "speeds_mm_s", "speed", " mm/s"
    one, many, axis = "a speed", "speeds", "speed (mm/s)"

    def at(self, groups: Sequence[Group]) -> str:
        return f"at {', '.join(map(key_of, groups))}{self.unit}"

    def printed(self, group: Group) -> str:
        return f"{key_of(group)}{self.unit}"

    def named(self, group: Group) -> str:
        return f"speed {self.printed(group)}"

    def by_recording(self, recordings: Iterable[Responses]) -> Mapping[str, Group]:
        found: dict[str, Group] = {}
        for responses in recordings:
            name, speed = str(responses.attrs["name"]), speed_of(responses)
            if speed is None:
                do = "say it in the session (speed_mm_s) and extract again, or hold out something "
                do += "else, such as --split trial"
                if has_speed(responses):
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
                    f"{slow:g} and {fast:g} mm/s: who learns from one has seen the other; declare "
                    "the same speed_mm_s for both, or leave one out with --speeds"
                )
        return groups

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        return samples

    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        try:
            return tuple(float(speed) for speed in wanted)
        except (TypeError, ValueError):
            raise InputError(f"{option}: expected speeds in mm/s, found {wanted!r}") from None


SPEED: Split = _BySpeed("speed")
"""The default: one speed is held out at a time."""


@dataclass(frozen=True)
class ByPair(Split):
    """By two at once, such as `speed,force`: what is tested shares neither with what is learnt.

    A group is a cell of their table, `20/F100`. Learnt from are the cells of other rows and other
    columns; the rest of the row and the column that cross in the cell is left out.
    """

    @property
    def both(self) -> tuple[Split, Split]:
        """What each of the two holds out."""
        one, _, other = self.name.partition(",")
        return split_named(one), split_named(other)

    @property
    def one(self) -> str:
        """Return `a pair of speed and force`."""
        return f"a pair of {' and '.join(each.name for each in self.both)}"

    @property
    def many(self) -> str:
        """Return `pairs of speed and force`."""
        return self.one.replace("a pair", "pairs")

    @property
    def axis(self) -> str:
        """Return `speed (mm/s) / force`."""
        return " / ".join(each.axis for each in self.both)

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


_OF_PAIR = "/"
"""Stands between the two of a cell."""


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
    value, _ = natural_order(group)
    return (value, group)


# A split by the drum's angle: tested on a stretch of the drum that nothing was learnt from.
#
# The drum is divided into equal arcs. A sample is of the arc that holds all that the skin touched
# while it was taken: the drum's way from its start to its stop, and half the contact patch beyond
# either end. One that reaches into another arc is of none and is left out. So between what is
# learnt from in one arc and what is tested in the next there lies no bump that both have touched.
#
# Every speed and texture is in every arc: only the stretch of the drum is new in the test.

ANGLE = "angle"
ARCS = 5
"""Where the name gives no number: a fifth of the drum is tested, as many as can be long."""
_MOST = 99
_NOWHERE = -1


class ByAngle(Split):
    """By arcs of the drum: `angle` for five, `angle-8` for eight."""

    whole = False
    one, many = "an arc of the drum", "arcs of the drum"
    divided = "The drum of each"

    @property
    def n_arcs(self) -> int:
        """How many arcs there are."""
        _, _, number = self.name.partition("-")
        return int(number) if number else ARCS

    @property
    def axis(self) -> str:
        """Return it with the number of arcs."""
        return f"arc of the drum (of {self.n_arcs})"

    def at(self, groups: Sequence[Group]) -> str:
        """Return `in arc 2, 3 of 5`."""
        return f"in arc {', '.join(map(key_of, groups))} of {self.n_arcs}"

    def printed(self, group: Group) -> str:
        """Return `arc 2 of 5`."""
        return f"arc {key_of(group)} of {self.n_arcs}"

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        """Return all arcs, whose number goes from 1 on, after looking at each recording.

        Raises
        ------
        InputError
            If nothing logged a recording's angle, its log has a long gap, its drum turned less
            than once while it was steady, or angles of one texture's recordings count from
            different places.
        """
        if not 2 <= self.n_arcs <= _MOST:
            raise InputError(f"{OPTION}: expected 2 to {_MOST} arcs, found '{self.name}'")
        zeros: dict[str, tuple[str, str]] = {}
        for responses in recordings:
            name, way = str(responses.attrs["name"]), _path(responses)
            if (turns := way.turns(steady_s(responses))) < 1:
                raise InputError(
                    f"{OPTION}: expected a drum that turns at least once in each recording, found "
                    f"{turns:.2f} turns in {name}; record for longer, or leave slow recordings "
                    "out with --speeds"
                )
            gap_mm = way.longest_gap_mm(steady_s(responses))
            if gap_mm > LONGEST_GAP_MM:
                raise InputError(
                    f"{OPTION}: expected at most {LONGEST_GAP_MM:g} mm of the drum's way between "
                    f"two entries of its log, found {gap_mm:.1f} mm in {name}; record it again, or "
                    "leave such recordings out"
                )
            texture, zero = str(responses.attrs[dims.TEXTURE]), way.drum.zero
            first, there = zeros.setdefault(texture, (name, zero))
            if there != zero:
                raise InputError(
                    f"{OPTION}: expected angles of each drum that count from one place, found "
                    f"{first} and {name}, between which the drive was opened again; record with "
                    f"an index pulse or an absolute encoder (drum_zero = '{MARK}')"
                )
        return [str(number + 1) for number in range(self.n_arcs)]

    def by_recording(self, recordings: Iterable[Responses]) -> Mapping[str, Group]:
        """Return no group for any: a recording goes through all arcs."""
        return {str(responses.attrs["name"]): "" for responses in recordings}

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        """Return the samples that are of an arc, with its number.

        Raises
        ------
        InputError
            If samples are longer than an arc, or a texture has none in some arc.
        """
        names = samples[dims.RECORDING].values.astype(np.str_)
        arcs = np.full(len(samples), _NOWHERE)
        for responses in recordings:
            its = np.flatnonzero(names == str(responses.attrs["name"]))
            arcs[its] = self._arcs(samples[{dims.SAMPLE: its}], responses)
        numbers = (arcs + 1).astype(np.str_)
        whole = samples.assign_coords({self.coordinate: (dims.SAMPLE, numbers)})
        kept = whole.isel({dims.SAMPLE: np.flatnonzero(arcs != _NOWHERE)})
        arcs_there = [str(number + 1) for number in range(self.n_arcs)]
        require_everywhere(self, kept, arcs_there, "fewer arcs (--split angle-3)")
        return kept

    def _arcs(self, samples: Samples, responses: Responses) -> NDArray[np.int64]:
        """Return the number of each sample's arc, from 0; `_NOWHERE` where it is of none.

        Raises
        ------
        InputError
            If none of the recording's samples fits into an arc.
        """
        way = _path(responses)
        start, stop = (way.at(samples[name].values) for name in (dims.START, dims.STOP))
        beyond = way.drum.contact_mm / 2
        low, high = np.minimum(start, stop) - beyond, np.maximum(start, stop) + beyond
        length_mm = way.drum.circumference_mm / self.n_arcs
        first, last = np.floor(low / length_mm), np.floor(high / length_mm)
        arcs = np.where(first == last, first % self.n_arcs, _NOWHERE).astype(np.int64)
        if len(arcs) and (arcs == _NOWHERE).all():
            raise InputError(
                f"{OPTION}: expected samples that touch less than an arc, which is "
                f"{length_mm:.1f} mm long, found {(high - low).min():.1f} mm at least in "
                f"{responses.attrs['name']}, with {way.drum.contact_mm:g} mm of contact; take "
                "shorter windows (--window-s), fewer arcs (--split angle-3) or lower speeds"
            )
        return arcs


def require_everywhere(split: Split, samples: Samples, groups: Sequence[Group], wider: str) -> None:
    """Refuse a texture that has no sample in some group, where it would not be tested.

    Parameters
    ----------
    wider
        What makes groups wider, beside shorter windows and longer recordings.
    """
    textures, its = samples[dims.TEXTURE].values, samples[split.coordinate].values
    for texture in np.unique(textures):
        there = set(its[textures == texture].tolist())
        for group in groups:
            if group not in there:
                raise InputError(
                    f"{OPTION}: expected samples of every texture in every group, found none of "
                    f"{texture} in {split.printed(group)}; take shorter windows (--window-s), "
                    f"{wider}, or record for longer"
                )


def _path(responses: Responses) -> DrumPath:
    way = path_in(responses)
    if way is None:
        raise InputError(
            f"{OPTION}: expected the drum's angle in every recording, found none logged for "
            f"{responses.attrs['name']}; record with a drive that is read and the plan's drum_mm, "
            "and extract into a new store"
        )
    return way


def split_named(name: str) -> Split:
    """Return what is held out under a name: `speed`, `angle` (`angle-8`), a condition's, or a pair.

    Raises
    ------
    InputError
        If it is none.
    """
    if name == SPEED.name:
        return SPEED
    if re.fullmatch(rf"{ANGLE}(-\d+)?", name):
        return ByAngle(name)
    from afferents.folds import bands  # which is made of this module's splits

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
    """Return the name of the column that says what a table's rows were held out with."""
    return SPEED.column if SPEED.column in table else Split.column


def folder_name(group: Group) -> str:
    """Return a name of a folder that no other group has, nor a mark beside it."""
    if not isinstance(group, str):
        return key_of(group)
    return re.sub(r"[^\w +=-]", lambda found: _percent(found.group()), group)


def _percent(character: str) -> str:
    return "".join(f"%{byte:02X}" for byte in character.encode("utf-8", "surrogatepass"))


def text_of(value: Any) -> str:
    """Return the value of a condition as text: 1, 1.0 and ``1`` are the same trial."""
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 1e15
    return str(int(value)) if whole else str(value).strip()

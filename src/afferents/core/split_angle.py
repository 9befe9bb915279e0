"""A split by the drum's angle: tested on a stretch of the drum that nothing was learnt from.

The drum is divided into equal arcs. A sample is of the arc that holds all that the skin touched
while it was taken: the drum's way from its start to its stop, and half the contact patch beyond
either end. One that reaches into another arc is of none and is left out. So between what is learnt
from in one arc and what is tested in the next there lies no bump that both have touched.

Every speed and texture is in every arc: only the stretch of the drum is new in the test.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.drum import LONGEST_GAP_MM, MARK, Way, way_in
from afferents.core.errors import InputError
from afferents.core.responses import Responses, steady_s
from afferents.core.samples import Samples
from afferents.core.split_base import OPTION, Group, Split, key_of

ANGLE = "angle"
ARCS = 5
"""Where the name gives no number: a fifth of the drum is tested, as many as can be long."""
_MOST = 99
_NOWHERE = -1


class ByAngle(Split):
    """By arcs of the drum: `angle` for five, `angle-8` for eight."""

    ordered, whole = False, False
    coordinate, column = dims.GROUP, "held_out_group"
    held_out, validation, groups = "held_out_group", "validation_group", "groups"
    by, worst, validations = "by_group", "worst_group", "validation_groups"
    leaks = "group"

    @property
    def n_arcs(self) -> int:
        """How many arcs there are."""
        _, _, number = self.name.partition("-")
        return int(number) if number else ARCS

    @property
    def one(self) -> str:
        """Return `an arc of the drum`."""
        return "an arc of the drum"

    @property
    def many(self) -> str:
        """Return `arcs of the drum`."""
        return "arcs of the drum"

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

    def named(self, group: Group) -> str:
        """Return the same."""
        return self.printed(group)

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
            raise InputError(OPTION, f"2 to {_MOST} arcs", f"'{self.name}'")
        zeros: dict[str, tuple[str, str]] = {}
        for responses in recordings:
            name, way = str(responses.attrs["name"]), _way(responses)
            if (turns := way.turns(steady_s(responses))) < 1:
                raise InputError(
                    OPTION,
                    "a drum that turns at least once in each recording",
                    f"{turns:.2f} turns in {name}",
                    "record for longer, or leave slow recordings out with --speeds",
                )
            _require_no_gap(way, responses)
            texture, zero = str(responses.attrs[dims.TEXTURE]), way.drum.zero
            first, there = zeros.setdefault(texture, (name, zero))
            if there != zero:
                raise InputError(
                    OPTION,
                    "angles of each drum that count from one place",
                    f"{first} and {name}, between which the drive was opened again",
                    f"record with an index pulse or an absolute encoder (drum_zero = '{MARK}')",
                )
        return [str(number + 1) for number in range(self.n_arcs)]

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
        self._require_everywhere(kept)
        return kept

    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        """Return numbers of arcs as text."""
        return tuple(str(number).strip() for number in wanted)

    def _arcs(self, samples: Samples, responses: Responses) -> NDArray[np.int64]:
        """Return the number of each sample's arc, from 0; `_NOWHERE` where it is of none.

        Raises
        ------
        InputError
            If none of the recording's samples fits into an arc.
        """
        way = _way(responses)
        start, stop = (way.at(samples[name].values) for name in (dims.START, dims.STOP))
        beyond = way.drum.contact_mm / 2
        low, high = np.minimum(start, stop) - beyond, np.maximum(start, stop) + beyond
        length_mm = way.drum.circumference_mm / self.n_arcs
        first, last = np.floor(low / length_mm), np.floor(high / length_mm)
        arcs = np.where(first == last, first % self.n_arcs, _NOWHERE).astype(np.int64)
        if len(arcs) and (arcs == _NOWHERE).all():
            raise InputError(
                OPTION,
                f"samples that touch less than an arc, which is {length_mm:.1f} mm long",
                f"{(high - low).min():.1f} mm at least in {responses.attrs['name']}, with "
                f"{way.drum.contact_mm:g} mm of contact",
                "take shorter windows (--window-s), fewer arcs (--split angle-3) or lower speeds",
            )
        return arcs

    def _require_everywhere(self, samples: Samples) -> None:
        """Refuse a texture that has no sample in some arc, where it would not be tested."""
        textures, arcs = samples[dims.TEXTURE].values, samples[self.coordinate].values
        for texture in np.unique(textures):
            there = set(arcs[textures == texture].tolist())
            for number in range(1, self.n_arcs + 1):
                if str(number) not in there:
                    raise InputError(
                        OPTION,
                        "samples of every texture in every arc",
                        f"none of {texture} in {self.printed(str(number))}",
                        "take shorter windows (--window-s), fewer arcs (--split angle-3), or "
                        "record for longer",
                    )


def _way(responses: Responses) -> Way:
    way = way_in(responses)
    if way is None:
        raise InputError(
            OPTION,
            "the drum's angle in every recording",
            f"none logged for {responses.attrs['name']}",
            "record with a drive that is read and the plan's drum_mm, and extract into a new store",
        )
    return way


def _require_no_gap(way: Way, responses: Responses) -> None:
    """Refuse a log of whose steady part too long a stretch is missing."""
    gap_mm = way.longest_gap_mm(steady_s(responses))
    if gap_mm > LONGEST_GAP_MM:
        raise InputError(
            OPTION,
            f"at most {LONGEST_GAP_MM:g} mm of the drum's way between two entries of its log",
            f"{gap_mm:.1f} mm in {responses.attrs['name']}",
            "record it again, or leave such recordings out",
        )

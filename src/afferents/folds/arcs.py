"""Hold out an arc of the drum: tested on a stretch of the drum that nothing was learnt from.

The drum is divided into equal arcs. A sample is of the arc that holds all that the skin touched
while it was taken: the drum's way from its start to its stop, and half the contact patch beyond
either end. One that reaches into another arc is of none and is left out. So between what is
learnt from in one arc and what is tested in the next there lies no bump that both have touched.

Every speed and texture is in every arc: only the stretch of the drum is new in the test.
"""

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.folds.held_out import OPTION, Group, Split, keep_parts
from afferents.store.drum_path import LONGEST_GAP_MM, MARK, DrumPath, read_path
from afferents.store.responses import Responses, steady_s

NAME = re.compile(r"angle(-\d+)?")
ARCS = 5
"""Where the name gives no number: a fifth of the drum is tested, as many as can be long."""
_MOST = 99
_NOWHERE = -1


class ByAngle(Split):
    """By arcs of the drum: `angle` for five, `angle-8` for eight."""

    whole, divided = False, "The drum of each"

    def __init__(self, name: str) -> None:
        """Set the words, with the number of arcs."""
        super().__init__(name)
        number = name.partition("-")[2]
        self.n_arcs = int(number) if number else ARCS
        self.one, self.many = "an arc of the drum", "arcs of the drum"
        self.axis = f"arc of the drum (of {self.n_arcs})"
        self.printed_as, self.at_as = f"arc {{}} of {self.n_arcs}", f"in arc {{}} of {self.n_arcs}"

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
            name, way = str(responses.attrs["name"]), _find_path(responses)
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
        parts = np.where(arcs == _NOWHERE, "", (arcs + 1).astype(np.str_))
        there = [str(number + 1) for number in range(self.n_arcs)]
        return keep_parts(self, samples, parts, there, "fewer arcs (--split angle-3)")

    def _arcs(self, samples: Samples, responses: Responses) -> NDArray[np.int64]:
        """Return the number of each sample's arc, from 0; `_NOWHERE` where it is of none.

        Raises
        ------
        InputError
            If none of the recording's samples fits into an arc.
        """
        way = _find_path(responses)
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


def _find_path(responses: Responses) -> DrumPath:
    way = read_path(responses)
    if way is None:
        raise InputError(
            f"{OPTION}: expected the drum's angle in every recording, found none logged for "
            f"{responses.attrs['name']}; record with a drive that is read and the plan's drum_mm, "
            "and extract into a new store"
        )
    return way

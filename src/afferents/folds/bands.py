"""Hold out a band of speed or of force, where they change within recordings.

A sample is of the band in which all of its moments lie. One that crosses from a band into another
is of none: it is neither learnt from nor tested, so what is tested has no moment in a band that was
learnt from.
"""

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.folds.held_out import OPTION, Group, Split, keep_parts, key_of
from afferents.store.motion import Series, force_along, speed_along, spread, steady_values
from afferents.store.responses import Responses, speed_of

UNITS = {"speed": " mm/s", "force": " N"}
NAME = re.compile(r"(speed|force)(-in-\d+|(-\d+(\.\d+)?)+)")
_MOST = 99
_DIGITS = 3


class ByBand(Split):
    """By bands, named with their edges: `speed-20-40-60`, or `force-in-4` for four quantiles.

    Bands reach from an edge to the next; the first begins at 0, the last has no end. A group is
    named by the lower edge of its band. Quantiles are of all moments of the steady parts.
    """

    whole = False

    def __init__(self, name: str) -> None:
        """Set the words, and the edges that the name gives; none of quantiles."""
        super().__init__(name)
        self.of_what, *edges = name.split("-")
        self._given = [] if edges[0] == "in" else [float(edge) for edge in edges]
        self.unit = UNITS[self.of_what]
        self.title, self.many = f"band of {self.of_what}", f"bands of {self.of_what}"
        self.one = f"a {self.title}"
        self.axis = f"{self.title}, from ({self.unit.strip()})"
        self.divided = f"The {self.of_what} in recordings of each"
        self.at_as = f"in the bands of {self.of_what} from {{}}{self.unit}"

    def settled(self, recordings: Sequence[Responses]) -> "ByBand":
        """Return it with the edges that quantiles come to."""
        edges = "-".join(f"{edge:g}" for edge in self.edges(recordings))
        return ByBand(f"{self.of_what}-{edges}")

    def printed(self, group: Group) -> str:
        """Return `speed 20 to 40 mm/s`, or where the edges are not known yet its lower one."""
        later = [edge for edge in self._given if edge > float(group)]
        end = f" to {later[0]:g}{self.unit}" if later else f"{self.unit} and more"
        return f"{self.of_what} {key_of(group)}{end if self._given else self.unit + ' on'}"

    def edges(self, recordings: Iterable[Responses]) -> NDArray[np.float64]:
        """Return the edges between bands, ascending, in the unit.

        Raises
        ------
        InputError
            If edges do not rise, or there are fewer than two bands or more than `_MOST`.
        """
        edges = np.array(self._given)
        if not len(edges):
            n = int(self.name.rpartition("-")[2])
            if not 2 <= n <= _MOST:
                raise InputError(f"--bands: expected 2 to {_MOST} bands, or their edges, found {n}")
            moments = np.concatenate([self._moments(one) for one in recordings])
            edges = np.quantile(moments, np.arange(1, n) / n)
            edges = np.array([float(f"{edge:.{_DIGITS}g}") for edge in edges])
            if (np.diff(edges) <= 0).any():
                raise InputError(
                    f"--bands: expected edges such as 20,40, or how many bands, found {n}, which "
                    f"is more than the {self.of_what} has values for; take fewer"
                )
        if (edges <= 0).any() or (np.diff(edges) <= 0).any():
            found = ", ".join(f"{edge:g}" for edge in edges)
            raise InputError(f"--bands: expected edges above 0 that rise, found {found}")
        return edges

    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        """Return the bands in which recordings have moments, by their lower edges.

        Raises
        ------
        InputError
            If it is not known how the speed, or the force, of a recording went.
        """
        there = list(recordings)
        return self._bands_in([self._moments(one) for one in there], self.edges(there))

    def _bands_in(
        self, moments: Sequence[NDArray[np.float64]], edges: NDArray[np.float64]
    ) -> list[Group]:
        found = {n for its in moments for n in np.searchsorted(edges, its, side="right")}
        if len(found) < 2:
            listed = ", ".join(f"{edge:g}" for edge in edges)
            raise InputError(
                f"--bands: expected edges between which the {self.of_what} lies, which goes from "
                f"{spread(moments)}{self.unit}, found {listed}; take others"
            )
        return [f"{edges[n - 1]:g}" if n else "0" for n in sorted(found)]

    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        """Return the samples that lie in one band, with its lower edge.

        Raises
        ------
        InputError
            If no sample of a recording fits into a band, or a texture has none in some band.
        """
        there = list(recordings)
        edges, names = self.edges(there), samples[dims.RECORDING].values.astype(np.str_)
        bands = np.full(len(samples), -1)
        for responses in there:
            its = np.flatnonzero(names == str(responses.attrs["name"]))
            mine = samples[{dims.SAMPLE: its}]
            start, stop = mine[dims.START].values, mine[dims.STOP].values
            _, low, high = self._series(responses).over(start, stop)
            first, last = (np.searchsorted(edges, ends, side="right") for ends in (low, high))
            bands[its] = np.where((first == last) & np.isfinite(low), first, -1)
        if (bands == -1).all():
            raise InputError(
                f"{OPTION}: expected samples that stay within a band of {self.of_what}, found none "
                f"of {len(samples)}; take shorter windows (--window-s, --frames) or wider bands"
            )
        lower = np.array(["0", *(f"{edge:g}" for edge in edges), ""])  # -1 is of no band
        moments = [self._moments(one) for one in there]
        wider = f"other bands (--bands; the {self.of_what} goes from {spread(moments)}{self.unit})"
        return keep_parts(self, samples, lower[bands], self._bands_in(moments, edges), wider)

    def _moments(self, responses: Responses) -> NDArray[np.float64]:
        """Return the values of a recording's steady part at regular moments."""
        return steady_values(self._series(responses), responses)

    def _series(self, responses: Responses) -> Series:
        if self.of_what == "force":
            found, do = force_along(responses), "keep a log of force next to it"
        else:
            found, do = speed_along(responses), "give its speed_mm_s, or keep a log next to it"
            if found is None and (speed := speed_of(responses)) is not None:
                found = Series(np.array([0.0, 1e6]), np.array([speed, speed]))
        if found is None:
            raise InputError(
                f"{OPTION}: expected the {self.of_what} of every recording, found none of "
                f"{responses.attrs['name']}; {do}, and extract again"
            )
        return found


def name_bands(split: str, bands: str) -> str:
    """Return the name of the split by bands, from the values of `--split` and `--bands`.

    Raises
    ------
    InputError
        If bands are neither edges nor how many, or of what has none.
    """
    if split not in UNITS:
        raise InputError(f"--bands: expected --split speed or --split force, found '{split}'")
    if re.fullmatch(r"\d+", bands):
        return f"{split}-in-{bands}"
    parts = [part.strip() for part in bands.split(",")]
    if not all(re.fullmatch(r"\d+(\.\d+)?", part) for part in parts):
        raise InputError(
            f"--bands: expected edges such as 20,40,60, or how many bands, found '{bands}'"
        )
    return "-".join([split, *parts])

"""Which units fired in the last second, as frames and sound come: spikes with the responses."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.lab.live.touch import Filled
from afferents.spikes.afferents import afferent_classes, can_hold
from afferents.spikes.stream import MarkerUnits, VibrationUnits
from afferents.spikes.units import UNIT_MODELS, Fired

SPAN_S = 1.0
"""Spikes older than that are forgotten."""
SHOWN = 30
"""About this many units of a class are simulated, evenly among the markers."""
_MODEL = UNIT_MODELS["izhikevich"]


class Trains(NamedTuple):
    """The last second of one class.

    Attributes
    ----------
    name
        Of the class.
    units
        Their names, as `artificial_spikes` has them.
    age_s
        For each unit, how long ago it fired, s; the oldest spike first.
    """

    name: str
    units: list[str]
    age_s: list[NDArray[np.float64]]

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON has it: ages in whole ms, and the mean number of spikes of a unit."""
        spikes_a_unit = sum(map(len, self.age_s)) / len(self.units)
        ages_ms = [np.rint(1e3 * age).astype(int).tolist() for age in self.age_s]
        return {
            "name": self.name,
            "units": self.units,
            "ages_ms": ages_ms,
            "spikes_a_unit": round(spikes_a_unit, 1),
        }


@dataclass
class _Class:
    """Units of a class, and what they fired in the last second: until when, at which times, which.

    That is replaced whole, so that another thread may read it.
    """

    units: MarkerUnits | VibrationUnits
    names: list[str]
    recent: tuple[float, NDArray[np.float64], NDArray[np.int64]]


class Raster:
    """The last second of the units that one sense drives; of none before spikes are shown."""

    def __init__(self) -> None:
        """Wait for what comes."""
        self._classes: list[_Class] = []

    def begin(self) -> None:
        """Forget all."""
        self._classes = []

    def skip(self) -> None:
        """Let units begin anew."""
        for one in self._classes:
            one.units.skip()

    def take(self, time_s: float, came: Any) -> None:
        """Drive them with what came at a time, s."""

    def trains(self) -> list[Trains]:
        """Return the last second of each class."""
        found = []
        for one in self._classes:
            now_s, time_s, unit = one.recent
            ages_s = [now_s - time_s[unit == i] for i in range(len(one.names))]
            found.append(Trains(one.units.afferent.name, one.names, ages_s))
        return found

    def _add(self, units: MarkerUnits | VibrationUnits, numbers: Iterable[int]) -> None:
        names = [f"{units.afferent.name}-{number}" for number in numbers]
        self._classes.append(_Class(units, names, (0.0, np.empty(0), np.empty(0, np.int64))))

    def _keep(self, one: _Class, fired: Fired, now_s: float) -> None:
        """Keep what units fired until now, without what is older than a second."""
        time_s, unit = (np.concatenate(pair) for pair in zip(one.recent[1:], fired, strict=True))
        is_recent = time_s > now_s - SPAN_S
        one.recent = now_s, time_s[is_recent], unit[is_recent]


class MarkerRaster(Raster):
    """Some of the SA and RA units that `artificial_spikes` drives by SA-I and RA-I."""

    _n_markers = 0

    def take(self, time_s: float, filled: Filled) -> None:
        """Drive them with a frame; they begin anew where none came just before."""
        touch = filled.touch
        if touch.now.grey is not None:  # units are driven by px
            return
        lost = ~touch.detected
        if not self._classes or len(lost) != self._n_markers:
            self._classes, self._n_markers = [], len(lost)
            every = max(1, round(len(lost) / SHOWN))
            for afferent in (afferent_classes()[name] for name in ("SA", "RA")):
                units = MarkerUnits(afferent, _MODEL, every=every)
                self._add(units, range(0, len(lost), every))
        if touch.before is None:
            self.skip()
        before = lost if touch.before is None else np.isnan(touch.before.position[:, 0])
        # what lost markers last showed is held here, and drives nothing offline
        missing = {dims.SA1: lost, dims.RA1: lost | before}
        for one in self._classes:
            variable = one.units.afferent.variable
            response = np.full(len(lost), np.nan, np.float32)
            if variable in filled.markers:
                response = np.where(missing[variable], np.nan, filled.markers[variable][0])
            self._keep(one, one.units.feed(time_s, response), time_s)


class VibrationRaster(Raster):
    """The PC units that `artificial_spikes` drives by the microphone.

    Parameters
    ----------
    rate_hz
        Of the sound. A rate that can hold none of their bands has no units.
    """

    def __init__(self, rate_hz: float) -> None:
        """Wait for sound."""
        self._rate_hz = rate_hz
        self.begin()

    def begin(self) -> None:
        """Forget all."""
        super().begin()
        afferent = afferent_classes()["PC"]
        if any(can_hold(afferent.bands_hz, self._rate_hz)):
            units = VibrationUnits(afferent, _MODEL, self._rate_hz)
            self._add(units, range(len(afferent.bands_hz)))

    def take(self, time_s: float, samples: NDArray[np.floating]) -> None:
        """Drive them with samples, `(n, channel)`, the first of them taken at `time_s`."""
        for one in self._classes:
            fired = one.units.feed(time_s, samples[:, 0])
            self._keep(one, fired, time_s + len(samples) / self._rate_hz)


def compile_units() -> None:
    """Compile the model of units, so that nothing that comes waits for it."""
    units = MarkerUnits(afferent_classes()["SA"], _MODEL)
    for time_s in (0.0, 0.01):
        units.feed(time_s, np.zeros(1, np.float32))

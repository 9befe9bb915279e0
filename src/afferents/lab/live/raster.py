"""Which units fired in the last second, as frames and sound come: spikes beside the responses."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.lab.live.images import Filled
from afferents.spikes.afferents import afferent_classes, can_hold
from afferents.spikes.stream import MarkerUnits, VibrationUnits
from afferents.spikes.units import UNIT_MODELS, Fired

SPAN_S = 1.0
"""Spikes older than that are forgotten."""
SHOWN = 30
"""About so many units of a class are simulated, evenly among the markers."""
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


class _Class:
    """Units of a class, and what they fired in the last second.

    That is replaced whole, so that another thread may read it.
    """

    def __init__(self, units: MarkerUnits | VibrationUnits, numbers: Iterable[int]) -> None:
        self.units = units
        self._name = units.afferent.name
        self._names = [f"{self._name}-{number}" for number in numbers]
        self._recent = 0.0, np.empty(0), np.empty(0, np.int64)

    def take(self, new: Fired, now_s: float) -> None:
        _, time_s, unit = self._recent
        time_s = np.concatenate([time_s, new.time_s])
        unit = np.concatenate([unit, new.unit])
        kept = time_s > now_s - SPAN_S
        self._recent = now_s, time_s[kept], unit[kept]

    def trains(self) -> Trains:
        now_s, time_s, unit = self._recent
        ages = [now_s - time_s[unit == i] for i in range(len(self._names))]
        return Trains(self._name, self._names, ages)


class Raster:
    """The last second of the units that one sense drives; of none, where nobody asked."""

    _classes: Sequence[_Class] = ()

    def begin(self) -> None:
        """Forget all."""

    def skip(self) -> None:
        """Let units begin anew."""
        for one in self._classes:
            one.units.skip()

    def take(self, time_s: float, came: Any) -> None:
        """Drive them with what came at a time, s."""

    def trains(self) -> list[Trains]:
        """Return the last second of each class."""
        return [one.trains() for one in self._classes]


class MarkerRaster(Raster):
    """Some of the SA and RA units that `artificial_spikes` drives by SA-I and RA-I."""

    def __init__(self) -> None:
        """Wait for the first frame."""
        _compile()
        self.begin()

    def begin(self) -> None:
        """Forget all."""
        self._classes, self._n_markers = (), 0
        self.skip()

    def skip(self) -> None:
        """Let units begin anew."""
        self._lost_before: NDArray[np.bool_] | None = None
        super().skip()

    def take(self, time_s: float, felt: Filled) -> None:
        """Drive them with a frame."""
        if felt.touch.now.grey is not None:  # units are driven by px
            return
        lost = ~felt.touch.detected
        if len(lost) != self._n_markers:
            self._n_markers = len(lost)
            self._classes = _of_markers(len(lost))
        before = lost if self._lost_before is None else self._lost_before
        self._lost_before = lost
        # what lost markers last showed is held here, and drives nothing offline
        missing = {dims.SA1: lost, dims.RA1: lost | before}
        for one in self._classes:
            variable = one.units.afferent.variable
            response = np.full(len(lost), np.nan, np.float32)
            if variable in felt.markers:
                response = np.where(missing[variable], np.nan, felt.markers[variable][0])
            one.take(one.units.feed(time_s, response), time_s)


def _compile() -> None:
    """Let nothing that comes wait until the model is compiled."""
    units = MarkerUnits(afferent_classes()["SA"], _MODEL)
    for time_s in (0.0, 0.01):
        units.feed(time_s, np.zeros(1, np.float32))


def _of_markers(n_markers: int) -> list[_Class]:
    every = max(1, round(n_markers / SHOWN))
    numbers = range(0, n_markers, every)
    classes = afferent_classes()
    return [
        _Class(MarkerUnits(classes[name], _MODEL, every=every), numbers) for name in ("SA", "RA")
    ]


class VibrationRaster(Raster):
    """The PC units that `artificial_spikes` drives by the microphone.

    Parameters
    ----------
    rate_hz
        Of the sound. A rate that can hold none of their bands has no units.
    """

    def __init__(self, rate_hz: float) -> None:
        """Wait for sound."""
        _compile()
        self._rate_hz = rate_hz
        self.begin()

    def begin(self) -> None:
        """Forget all."""
        afferent = afferent_classes()["PC"]
        if any(can_hold(afferent.bands_hz, self._rate_hz)):
            units = VibrationUnits(afferent, _MODEL, self._rate_hz)
            self._classes = [_Class(units, range(len(afferent.bands_hz)))]

    def take(self, time_s: float, samples: NDArray[np.floating]) -> None:
        """Drive them with samples, `(n, channel)`, the first of them taken at `time_s`."""
        for one in self._classes:
            fired = one.units.feed(time_s, samples[:, 0])
            one.take(fired, time_s + len(samples) / self._rate_hz)

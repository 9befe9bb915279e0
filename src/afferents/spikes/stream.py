"""Units that are driven piece by piece, live: they fire as on the whole recording."""

import math

import numpy as np
from numpy.typing import NDArray

from afferents.spikes.afferents import AfferentClass, filter_bands, steps_per_sample
from afferents.spikes.units import RATE_HZ, Drive, Fired, State, UnitModel

_AROUND_S = 0.1
"""Filters look both ways; what is farther away than this no longer matters."""
_HOP_S = 0.05
"""Vibration is filtered in pieces of about this length."""
SEED = 0
"""The usual one, whose units `artificial_spikes` has."""


class UnitStream:
    """Units of a class that keep their state from one piece of what drives them to the next.

    Parameters
    ----------
    afferent
        Their class.
    model
        Of a unit.
    """

    def __init__(self, afferent: AfferentClass, model: UnitModel) -> None:
        """Begin at rest."""
        self.afferent, self.model = afferent, model
        self.values = afferent.values(model.name)
        self.skip()

    def skip(self) -> None:
        """Restart at rest: what comes next does not follow what came before."""
        self._state: State | None = None

    def _fire(self, drive: Drive, from_s: float) -> Fired:
        """Go on for some steps, the first of them at `from_s`."""
        if self._state is None:
            self._state = self.model.at_rest(drive.current.shape[1], self.values)
        fired = self.model.fire(drive, self.values, self._state)
        return Fired(from_s + fired.time_s, fired.unit)


class MarkerUnits(UnitStream):
    """Units of a marker each, driven frame by frame.

    Parameters
    ----------
    every
        Of how many markers one has a unit that is simulated.
    """

    def __init__(self, afferent: AfferentClass, model: UnitModel, every: int = 1) -> None:
        """Wait for the first frame."""
        self.every = every
        super().__init__(afferent, model)

    def skip(self) -> None:
        """Restart: the next frame is the first."""
        super().skip()
        self._first_s, self._step = 0.0, 0
        self._before: tuple[float, NDArray[np.float32]] | None = None

    def feed(self, time_s: float, response: NDArray[np.floating]) -> Fired:
        """Return the spikes between the frame before and this one; none for the first.

        Parameters
        ----------
        time_s
            Of the frame, later than that before.
        response
            `(marker,)`, NaN where one is lost.
        """
        current = self.afferent.current(response[None], self.values["gain"], SEED)[0, :: self.every]
        before, self._before = self._before, (time_s, current)
        if before is None:
            self._first_s = time_s
            return Fired(np.empty(0), np.empty(0, np.int64))
        stop = math.ceil((time_s - self._first_s) * RATE_HZ - 1e-6)
        steps = self._first_s + np.arange(self._step, stop) / RATE_HZ
        weight = np.clip((steps - before[0]) / (time_s - before[0]), 0, 1).astype(np.float32)
        from_s, self._step = self._first_s + self._step / RATE_HZ, stop
        row = np.zeros(len(steps), np.int64)
        return self._fire(Drive(np.stack([before[1], current]), row, weight), from_s)


class VibrationUnits(UnitStream):
    """Units of a band each, driven by sound, piece by piece.

    They begin 0.1 s after the sound, and say so some 0.15 s later, since the filters look
    both ways.

    Parameters
    ----------
    rate_hz
        Of the sound.
    """

    def __init__(self, afferent: AfferentClass, model: UnitModel, rate_hz: float) -> None:
        """Wait for sound."""
        self.rate_hz = rate_hz
        # pieces of whole steps that are whole samples, too
        shared = steps_per_sample(rate_hz)
        around, hop = (math.ceil(s * RATE_HZ / shared.numerator) for s in (_AROUND_S, _HOP_S))
        self._around, self._hop = around * shared.numerator, hop * shared.numerator
        self._hop_samples = hop * shared.denominator
        self._piece_samples = (2 * around + hop) * shared.denominator
        super().__init__(afferent, model)

    def skip(self) -> None:
        """Restart: the next sample is the first."""
        super().skip()
        self._waiting = np.empty(0)

    def feed(self, time_s: float, samples: NDArray[np.floating]) -> Fired:
        """Return the spikes of what can be filtered by now.

        Parameters
        ----------
        time_s
            Of the first sample.
        samples
            `(n,)`, which follow those before.
        """
        begin_s = time_s - len(self._waiting) / self.rate_hz
        self._waiting = np.concatenate([self._waiting, samples])
        found: list[Fired] = []
        while len(self._waiting) >= self._piece_samples:
            piece = self._waiting[: self._piece_samples]
            n = 2 * self._around + self._hop
            bands = filter_bands(piece, self.rate_hz, self.afferent.bands_hz, n)
            inside = bands[self._around : self._around + self._hop]
            current = self.afferent.current(inside, self.values["gain"], SEED)
            drive = Drive(current, np.arange(self._hop), np.zeros(self._hop, np.float32))
            found.append(self._fire(drive, begin_s + self._around / RATE_HZ))
            self._waiting = self._waiting[self._hop_samples :]
            begin_s += self._hop_samples / self.rate_hz
        times = np.concatenate([np.empty(0), *(one.time_s for one in found)])
        return Fired(times, np.concatenate([np.empty(0, np.int64), *(one.unit for one in found)]))

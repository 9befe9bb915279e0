"""Izhikevich's unit: two equations that fire as many kinds of neuron do."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from afferents.spikes.units import kernel
from afferents.spikes.units.base import RATE_HZ, Drive, Fired, State, UnitModel

_MOST_HZ = 500
"""Room is made for so many spikes a second of each unit; more only if they come."""


class Izhikevich(UnitModel):
    """Izhikevich's simple model (IEEE Trans. Neural Netw. 14:1569, 2003).

    v' = 0.04 v^2 + 5 v + 140 - u + I and u' = a (b v - u), with time in ms, v in mV, and the
    current I in his units. At v = 30 mV the unit fires; then v = c and u grows by d.
    """

    name: ClassVar[str] = "izhikevich"
    parameters: ClassVar[tuple[str, ...]] = ("a", "b", "c", "d")

    def at_rest(self, n_units: int, values: Mapping[str, float]) -> State:
        """Return v = c and u = b c."""
        state = np.empty((2, n_units), np.float32)
        state[0] = values["c"]
        state[1] = np.float32(values["b"]) * state[0]
        return state

    def fire(self, drive: Drive, values: Mapping[str, float], state: State | None = None) -> Fired:
        """Return the spikes; a step is 0.5 ms, and times are whole steps."""
        a, b, c, d = (np.float32(values[name]) for name in self.parameters)
        n_steps, n_units = len(drive.row), drive.current.shape[1]
        begin = self.at_rest(n_units, values) if state is None else state
        room = max(int(n_steps / RATE_HZ * _MOST_HZ * n_units) // 8, 1024)
        while True:
            step, unit, now = np.empty(room, np.int64), np.empty(room, np.int64), begin.copy()
            n = kernel.izhikevich(*drive, now, np.float32(1e3 / RATE_HZ), a, b, c, d, step, unit)
            if n >= 0:
                begin[:] = now
                return Fired((step[:n] + 1) / RATE_HZ, unit[:n])
            room *= 2

"""The leaky integrate-and-fire unit."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from afferents.spikes.units import kernel
from afferents.spikes.units.base import RATE_HZ, Drive, Fired, State, UnitModel


class LeakyIntegrateAndFire(UnitModel):
    """A leaky integrator with a threshold (Lapicque 1907; Dayan & Abbott 2001, section 5.4).

    tau v' = I - v. At v = 1 the unit fires, v = 0, and nothing happens for the refractory time.
    A constant current I > 1 gives ``1 / (refractory + tau ln(I / (I - 1)))`` spikes a second.
    """

    name: ClassVar[str] = "lif"
    parameters: ClassVar[tuple[str, ...]] = ("tau_ms", "refractory_ms")

    def at_rest(self, n_units: int, values: Mapping[str, float]) -> State:
        """Return v = 0, and nothing left of a refractory time."""
        return np.zeros((2, n_units), np.float32)

    def fire(self, drive: Drive, values: Mapping[str, float], state: State | None = None) -> Fired:
        """Return the spikes; the threshold's crossing is found within a step of 0.5 ms."""
        state = self.at_rest(drive.current.shape[1], values) if state is None else state
        step_ms = 1e3 / RATE_HZ
        decay = np.float32(np.exp(-step_ms / values["tau_ms"]))
        refractory = np.float32(values["refractory_ms"] / step_ms)
        # in its refractory time a unit can't fire again, which says how many spikes there can be
        most = int(len(drive.row) / max(float(refractory), 1.0)) + 1
        room = most * drive.current.shape[1]
        step, unit = np.empty(room, np.int64), np.empty(room, np.int64)
        part = np.empty(room, np.float32)
        n = kernel.leaky(*drive, state, decay, refractory, step, unit, part)
        return Fired((step[:n] + part[:n].astype(np.float64)) / RATE_HZ, unit[:n])

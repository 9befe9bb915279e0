"""Models of a spiking unit: from the current that drives it to the times it fires."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.spikes import kernel

State = NDArray[np.float32]
"""What a model's equations are in, `(variable, unit)`."""
RATE_HZ = 2000.0
"""Steps a second, 0.5 ms each: Izhikevich's own step, and five of a cycle of 400 Hz."""
_MOST_HZ = 500
"""Spikes a second of each unit for which Izhikevich's model makes room; more only if they come."""


class Drive(NamedTuple):
    """Current into units, on the steps of the simulation.

    Between rows the current is interpolated linearly.

    Attributes
    ----------
    current
        `(row, unit)`, in the unit of the model's `gain`.
    row, weight
        `(step,)`: the current of a step is ``(1 - weight) * current[row] + weight *
        current[row + 1]``.
    """

    current: NDArray[np.float32]
    row: NDArray[np.int64]
    weight: NDArray[np.float32]


class Fired(NamedTuple):
    """Spikes in the order of time: when, in s from the first step, and of which unit."""

    time_s: NDArray[np.float64]
    unit: NDArray[np.int64]


class UnitModel(ABC):
    """A model of a spiking neuron; the same for all classes, with parameters of their own.

    To add one, write `fire` and, if units at rest are not all 0, `at_rest`; name the class in
    `units.UNIT_MODELS`, and give it a table of parameters in each class' TOML file (`sa.toml`,
    `ra.toml`, `pc.toml`) and a field for it in `AfferentClass`.

    Attributes
    ----------
    name
        In commands and in the TOML files.
    """

    name: ClassVar[str]

    def at_rest(self, n_units: int, values: Mapping[str, float]) -> State:
        """Return the state of units that nothing drives: two variables that are 0."""
        return np.zeros((2, n_units), np.float32)

    @abstractmethod
    def fire(self, drive: Drive, values: Mapping[str, float], state: State | None = None) -> Fired:
        """Return the spikes of units that a current drives.

        Parameters
        ----------
        drive
            Already multiplied by `gain`.
        values
            By the names that its equations have.
        state
            Before the first step; changed in place to that after the last. Default: at rest.
        """


def on_steps(
    time_s: NDArray[np.float64], start_s: float, stop_s: float
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return row and weight of each step from `start_s` to `stop_s` among rows at these times.

    Before the first row and after the last the nearest counts.
    """
    steps = start_s + np.arange(round((stop_s - start_s) * RATE_HZ)) / RATE_HZ
    row = np.clip(np.searchsorted(time_s, steps, side="right") - 1, 0, max(len(time_s) - 2, 0))
    following = np.minimum(row + 1, len(time_s) - 1)
    length = np.where(following > row, time_s[following] - time_s[row], 1.0)
    return row, np.clip((steps - time_s[row]) / length, 0, 1).astype(np.float32)


class Izhikevich(UnitModel):
    """Izhikevich's simple model (IEEE Trans. Neural Netw. 14:1569, 2003).

    v' = 0.04 v^2 + 5 v + 140 - u + I and u' = a (b v - u), with time in ms, v in mV, and the
    current I in his units. At v = 30 mV the unit fires; then v = c and u grows by d.
    """

    name: ClassVar[str] = "izhikevich"

    def at_rest(self, n_units: int, values: Mapping[str, float]) -> State:
        """Return v = c and u = b c."""
        state = np.empty((2, n_units), np.float32)
        state[0] = values["c"]
        state[1] = np.float32(values["b"]) * state[0]
        return state

    def fire(self, drive: Drive, values: Mapping[str, float], state: State | None = None) -> Fired:
        """Return the spikes; a step is 0.5 ms, and times are whole steps."""
        a, b, c, d = (np.float32(values[name]) for name in "abcd")
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


class LeakyIntegrateAndFire(UnitModel):
    """A leaky integrator with a threshold (Lapicque 1907; Dayan & Abbott 2001, section 5.4).

    tau v' = I - v. At v = 1 the unit fires, v = 0, and nothing happens for the refractory time.
    A constant current I > 1 gives ``1 / (refractory + tau ln(I / (I - 1)))`` spikes a second.
    """

    name: ClassVar[str] = "lif"

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


UNIT_MODELS: dict[str, UnitModel] = {
    model.name: model for model in (Izhikevich(), LeakyIntegrateAndFire())
}
"""Models of a unit by name; a new one is named here."""

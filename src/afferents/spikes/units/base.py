"""What a model of a spiking unit is: from the current that drives it to the times it fires."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

State = NDArray[np.float32]
"""What a model's equations are in, `(variable, unit)`."""
RATE_HZ = 2000.0
"""Steps a second, 0.5 ms each: Izhikevich's own step, and five of a cycle of 400 Hz."""


class Drive(NamedTuple):
    """Current into units, laid out on the steps of the simulation.

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

    To add one, write `at_rest` and `fire` in a file of its own, name the class in
    `units.UNIT_MODELS`, and give it a table of parameters in each class' TOML file (`sa.toml`,
    `ra.toml`, `pc.toml`).

    Attributes
    ----------
    name
        In commands and in the TOML files.
    parameters
        Names of the numbers it needs, beside `gain`.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[str, ...]]

    @abstractmethod
    def at_rest(self, n_units: int, values: Mapping[str, float]) -> State:
        """Return the state of units that nothing drives."""

    @abstractmethod
    def fire(self, drive: Drive, values: Mapping[str, float], state: State | None = None) -> Fired:
        """Return the spikes of units that are driven so.

        Parameters
        ----------
        drive
            Already multiplied by `gain`.
        values
            By name of `parameters`.
        state
            From which they go on; it becomes that after the last step. Without it, from rest.
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

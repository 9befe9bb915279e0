"""Classes of afferents: what drives their units, with every number's unit and source."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from afferents.core.documents import as_form, read_toml
from afferents.core.responses import Responses
from afferents.spikes.units.inputs import Input, of_bands, of_markers

_FILES = ("sa", "ra", "pc")


class Parameter(BaseModel):
    """A number, its unit, and where it comes from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    value: float
    unit: str
    source: str


class DriveParameters(BaseModel):
    """How a response becomes current: `gain * log(1 + max(0, response - threshold) / scale)`.

    The logarithm, since responses span a hundredfold and firing rates tenfold. Gains of units
    differ by a log-normal factor of this spread.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    threshold: Parameter
    scale: Parameter
    spread: Parameter


class AfferentClass(BaseModel):
    """One class, as its TOML file has it.

    Attributes
    ----------
    name
        ``SA``, ``RA`` or ``PC``.
    variable
        The response that drives it; see `core.responses`.
    bands_hz
        Of units that listen to vibration, a pass band each.
    izhikevich, lif
        Parameters of each model of a unit, `gain` among them; those of a further model stand in a
        table of its name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    variable: str
    input_unit: str
    bands_hz: tuple[tuple[float, float], ...] = ()
    drive: DriveParameters
    izhikevich: dict[str, Parameter]
    lif: dict[str, Parameter]

    def values(self, model: str) -> dict[str, float]:
        """Return the parameters of a model of a unit, by name."""
        parameters: Mapping[str, Parameter] = getattr(self, model)
        return {name: parameter.value for name, parameter in parameters.items()}

    def felt(self, recording: Responses, start_s: float, stop_s: float) -> Input:
        """Return what the units feel of a stretch of a recording; see `units.inputs`."""
        if self.bands_hz:
            return of_bands(recording, self.variable, self.bands_hz, start_s, stop_s)
        return of_markers(recording, self.variable, start_s, stop_s)

    def current(
        self, response: NDArray[np.floating], gain: float, seed: int
    ) -> NDArray[np.float32]:
        """Return the current into each unit.

        Parameters
        ----------
        response
            `(row, unit)`; NaN, where a marker is lost, drives nothing.
        seed
            Draws the units' gains: the same seed has the same units in every recording.
        """
        drive = self.drive
        above = np.nan_to_num(np.asarray(response, np.float32)) - np.float32(drive.threshold.value)
        np.maximum(above, 0, out=above)
        above /= np.float32(drive.scale.value)
        np.log1p(above, out=above)
        # each class draws from a stream of its own
        stream = np.random.default_rng([seed, *self.name.encode()])
        spread = np.exp(drive.spread.value * stream.standard_normal(response.shape[1]))
        above *= (gain * spread).astype(np.float32)
        return above


@cache
def afferent_classes() -> dict[str, AfferentClass]:
    """Return the classes by name, read from the files beside this one."""
    found = {}
    for stem in _FILES:
        path = Path(__file__).with_name(f"{stem}.toml")
        content = read_toml(path, "a class of afferents")
        read = as_form(content, AfferentClass, path, "a class of afferents")
        found[read.name] = read
    return found

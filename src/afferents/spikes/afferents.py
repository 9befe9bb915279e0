"""Classes of afferents: what drives their units, with every number's unit and source."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, resample_poly, sosfiltfilt

from afferents import dims
from afferents.documents import as_form, read_toml
from afferents.errors import InputError
from afferents.forms import StrictForm
from afferents.spikes.units import RATE_HZ, on_steps
from afferents.store.responses import Responses

_NYQUIST_SHARE = 0.95
"""A band that ends above this share of half the sample rate can't be filtered out."""
_ORDER = 2
_LARGEST_RATIO = 1000


class Input(NamedTuple):
    """A response that drives units, on the steps of the simulation; see `units.Drive`.

    Attributes
    ----------
    response
        `(row, unit)`.
    row, weight
        `(step,)`.
    resolution_s
        Timing below this is interpolation.
    receptive_fields
        For each unit, the markers or channels that it listens to.
    """

    response: NDArray[np.float32]
    row: NDArray[np.int64]
    weight: NDArray[np.float32]
    resolution_s: float
    receptive_fields: list[tuple[int, ...]]


def can_hold(bands_hz: Sequence[tuple[float, float]], rate_hz: float) -> list[bool]:
    """Return which bands a sample rate can hold."""
    return [high < _NYQUIST_SHARE * rate_hz / 2 for _, high in bands_hz]


def steps_per_sample(rate_hz: float) -> Fraction:
    """Return how many steps of the simulation a sample lasts: a ratio of small numbers."""
    return Fraction(RATE_HZ / rate_hz).limit_denominator(_LARGEST_RATIO)


def filter_bands(
    signal: NDArray[np.floating], rate_hz: float, bands_hz: Sequence[tuple[float, float]], n: int
) -> NDArray[np.float32]:
    """Return what each band holds of a signal, `(step, band)`, for `n` steps from its start."""
    # one rate for all recordings, so that a step of the simulation is a sample
    shared = steps_per_sample(rate_hz)
    loud = signal.astype(np.float64) - signal.mean(dtype=np.float64)  # else it begins with a step
    slow = resample_poly(loud, shared.numerator, shared.denominator)
    slow = np.pad(slow[:n], (0, max(n - len(slow), 0)))
    bands = np.zeros((n, len(bands_hz)), np.float32)
    for unit in np.flatnonzero(can_hold(bands_hz, rate_hz)).tolist():
        bands[:, unit] = sosfiltfilt(_band_filter(*bands_hz[unit]), slow)
    return bands


@cache
def _band_filter(low_hz: float, high_hz: float) -> NDArray[np.float64]:
    """Return the filter of a band, at the rate of the simulation."""
    sections: NDArray[np.float64] = butter(
        _ORDER, (low_hz, high_hz), "bandpass", fs=RATE_HZ, output="sos"
    )
    return sections


class Parameter(StrictForm):
    """A number, its unit, and where it comes from."""

    value: float
    unit: str
    source: str


class DriveParameters(StrictForm):
    """How a response becomes current: `gain * log(1 + max(0, response - threshold) / scale)`.

    The logarithm, since responses span a hundredfold and firing rates tenfold. Gains of units
    differ by a log-normal factor of this spread.
    """

    threshold: Parameter
    scale: Parameter
    spread: Parameter


class AfferentClass(StrictForm):
    """One class, as its TOML file has it.

    Attributes
    ----------
    name
        ``SA``, ``RA`` or ``PC``.
    variable
        The response that drives it; see `store.responses`.
    bands_hz
        Of units that listen to vibration, a pass band each.
    izhikevich, lif
        Parameters of each model of a unit, `gain` among them; those of a further model are in a
        table of its name.
    """

    name: str
    variable: str
    bands_hz: tuple[tuple[float, float], ...] = ()
    drive: DriveParameters
    izhikevich: dict[str, Parameter]
    lif: dict[str, Parameter]

    def values(self, model: str) -> dict[str, float]:
        """Return the parameters of a model of a unit, by name."""
        parameters: Mapping[str, Parameter] = getattr(self, model)
        return {name: parameter.value for name, parameter in parameters.items()}

    def read_input(self, recording: Responses, start_s: float, stop_s: float) -> Input:
        """Return the response to a stretch of a recording that drives the units.

        Of markers it is that of each, with current interpolated between frames; of vibration the
        first channel in each band (Butterworth, second order, both ways). A band that the sample
        rate can't hold is silent.

        Raises
        ------
        InputError
            If the sample rate of vibration holds none of the bands, or the response is of cells.
        """
        name, response = recording.attrs["name"], recording[self.variable]
        if self.bands_hz:
            rate_hz = float(response.attrs[dims.SAMPLE_RATE])
            if not any(can_hold(self.bands_hz, rate_hz)):
                lowest = min(high for _, high in self.bands_hz) * 2 / _NYQUIST_SHARE
                raise InputError(
                    f"{name}: expected vibration of more than {lowest:.0f} samples/s, found "
                    f"{rate_hz:g}"
                )
            signal = response.values[round(start_s * rate_hz) : round(stop_s * rate_hz), 0]
            n = round((stop_s - start_s) * RATE_HZ)
            bands = filter_bands(signal, rate_hz, self.bands_hz, n)
            row, weight = np.arange(n), np.zeros(n, np.float32)
            return Input(bands, row, weight, 1 / RATE_HZ, [(0,)] * len(self.bands_hz))
        if dims.of_cells(recording):
            raise InputError(
                f"{name}: expected {self.variable} in px, by which {self.name} units are driven, "
                "found grey levels, of cells; choose --classes PC"
            )
        time_s = recording[dims.TIME].values
        row, weight = on_steps(time_s, start_s, stop_s)
        fields: list[tuple[int, ...]] = [(marker,) for marker in range(response.shape[1])]
        return Input(response.values, row, weight, float(np.median(np.diff(time_s))), fields)

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
    """Return the classes by name, read from the files next to this one."""
    found = {}
    for stem in ("sa", "ra", "pc"):
        path = Path(__file__).with_name(f"{stem}.toml")
        content = read_toml(path, "a class of afferents")
        read = as_form(content, AfferentClass, path, "a class of afferents")
        found[read.name] = read
    return found

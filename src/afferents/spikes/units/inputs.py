"""What units feel of a recording: a marker each, or a band of the vibration each."""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, resample_poly, sosfiltfilt

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.responses import Responses
from afferents.spikes.units.base import RATE_HZ, on_steps

_NYQUIST_SHARE = 0.95
"""A band that ends above this share of half the sample rate can't be filtered out."""
_ORDER = 2
_LARGEST_RATIO = 1000


class Input(NamedTuple):
    """A response to units, laid out on the steps of the simulation; see `base.Drive`.

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


def of_markers(recording: Responses, variable: str, start_s: float, stop_s: float) -> Input:
    """Return the response of each marker; current is interpolated between frames."""
    time_s = recording[dims.TIME].values
    response = recording[variable].values
    row, weight = on_steps(time_s, start_s, stop_s)
    fields: list[tuple[int, ...]] = [(marker,) for marker in range(response.shape[1])]
    return Input(response, row, weight, float(np.median(np.diff(time_s))), fields)


def of_bands(
    recording: Responses,
    variable: str,
    bands_hz: Sequence[tuple[float, float]],
    start_s: float,
    stop_s: float,
) -> Input:
    """Return the first channel's vibration in each band (Butterworth, second order, both ways).

    A band that the sample rate can't hold is silent.

    Raises
    ------
    InputError
        If the rate holds none of the bands.
    """
    vibration = recording[variable]
    rate_hz = float(vibration.attrs[dims.SAMPLE_RATE])
    if not any(held(bands_hz, rate_hz)):
        lowest = min(high for _, high in bands_hz) * 2 / _NYQUIST_SHARE
        where, found = recording.attrs["name"], f"{rate_hz:g}"
        raise InputError(where, f"vibration of more than {lowest:.0f} samples/s", found)
    signal = vibration.values[round(start_s * rate_hz) : round(stop_s * rate_hz), 0]
    n = round((stop_s - start_s) * RATE_HZ)
    bands = in_bands(signal, rate_hz, bands_hz, n)
    return Input(bands, np.arange(n), np.zeros(n, np.float32), 1 / RATE_HZ, [(0,)] * len(bands_hz))


def held(bands_hz: Sequence[tuple[float, float]], rate_hz: float) -> list[bool]:
    """Tell which bands a sample rate can hold."""
    return [high < _NYQUIST_SHARE * rate_hz / 2 for _, high in bands_hz]


def steps_per_sample(rate_hz: float) -> Fraction:
    """Return how many steps of the simulation a sample lasts: a ratio of small numbers."""
    return Fraction(RATE_HZ / rate_hz).limit_denominator(_LARGEST_RATIO)


def in_bands(
    signal: NDArray[np.floating],
    rate_hz: float,
    bands_hz: Sequence[tuple[float, float]],
    n: int,
) -> NDArray[np.float32]:
    """Return what each band holds of a signal, `(step, band)`, for `n` steps from its start."""
    # one rate for all recordings, so that a step of the simulation is a sample
    shared = steps_per_sample(rate_hz)
    slow = resample_poly(signal.astype(np.float64), shared.numerator, shared.denominator)
    slow = np.pad(slow[:n], (0, max(n - len(slow), 0)))
    bands = np.zeros((n, len(bands_hz)), np.float32)
    for unit, (limits, is_held) in enumerate(zip(bands_hz, held(bands_hz, rate_hz), strict=True)):
        if is_held:
            bands[:, unit] = sosfiltfilt(_band(*limits), slow)
    return bands


@cache
def _band(low_hz: float, high_hz: float) -> NDArray[np.float64]:
    """Return the filter of a band, at the rate of the simulation."""
    sections: NDArray[np.float64] = butter(
        _ORDER, (low_hz, high_hz), "bandpass", fs=RATE_HZ, output="sos"
    )
    return sections

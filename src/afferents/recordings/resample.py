"""Rows that come at uneven times, brought to a regular clock."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_PASSED = 0.42
"""Share of the rate up to which the filter against aliasing passes all."""
_AGREES = 0.01
"""Rates that differ by less are one."""


@dataclass(frozen=True)
class Rows:
    """The rows of a file before they were resampled.

    Attributes
    ----------
    n, n_dropped
        How many there were, and how many of them did not come after all before them.
    step_ms, longest_ms
        Median and longest time between two that were kept, ms.
    limit_hz
        Up to where frequencies are kept: half the rate of rows that are `step_ms` apart, or what
        the new rate allows, Hz.
    """

    n: int
    n_dropped: int
    step_ms: float
    longest_ms: float
    limit_hz: float


def in_order(time_ms: Numbers) -> NDArray[np.bool_]:
    """Tell of each row (n,) whether it comes after all before it."""
    latest = np.maximum.accumulate(time_ms)
    return np.append(True, time_ms[1:] > latest[:-1])


def rows_of(time_ms: Numbers, n_dropped: int, rate_hz: float) -> Rows:
    """Describe the rows in order, of times (n,) in ms, that are brought to a rate in Hz."""
    step = np.diff(time_ms)
    usual_ms = float(np.median(step))
    allowed_hz = rate_hz * (0.5 if _finer(time_ms, rate_hz) == 1 else _PASSED)
    limit_hz = min(allowed_hz, 500 / usual_ms)
    return Rows(len(time_ms) + n_dropped, n_dropped, usual_ms, float(step.max()), limit_hz)


def resampled(time_ms: Numbers, values: Numbers, rate_hz: float, cubic: bool) -> Numbers:
    """Return what lies between rows, on a regular clock that begins at the first.

    Where rows come faster than the clock ticks, it is read between them on a finer clock, and
    filtered before samples are left out, so that no frequency appears as another.

    Parameters
    ----------
    time_ms
        (n,), rising.
    values
        (n, column).
    rate_hz
        Of the clock.
    cubic
        Whether by Akima's cubic (modified) instead of straight lines.

    Returns
    -------
    numpy.ndarray
        (sample, column).
    """
    finer = _finer(time_ms, rate_hz)
    period_ms = 1000 / (rate_hz * finer)
    n = math.floor((time_ms[-1] - time_ms[0]) / period_ms + 1e-6) + 1
    at_ms = time_ms[0] + period_ms * np.arange(n)
    if cubic and len(time_ms) > 2:
        from scipy.interpolate import Akima1DInterpolator

        found = Akima1DInterpolator(time_ms, values, method="makima")(
            np.minimum(at_ms, time_ms[-1])
        )
    else:
        found = np.stack([np.interp(at_ms, time_ms, column) for column in values.T], axis=1)
    if finer > 1:
        from scipy.signal import resample_poly

        found = resample_poly(found, 1, finer, axis=0, padtype="line")
    return np.asarray(found, np.float64)


def _finer(time_ms: Numbers, rate_hz: float) -> int:
    """Return how much finer a clock must be to be as fast as rows are in the mean."""
    rows_hz = 1000 * (len(time_ms) - 1) / float(time_ms[-1] - time_ms[0])
    return max(1, math.ceil(rows_hz / rate_hz - _AGREES))

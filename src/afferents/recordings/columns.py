"""What columns of a table tell: which are no signals, and when rows were taken.

Those that count, label or hold texts are no signals. Of times: their unit, their order, and how
rows are resampled to a regular clock.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents.recordings.description import UNITS_MS
from afferents.recordings.tables import Numbers, Table

RISES, TEXTS = "it rises or falls from row to row, as counters and clocks do", "it holds no numbers"
LABELS, DEAD = "it has one value in each file, as labels do", "it never changes, in any file"
_BACK, _ON = 0.01, 0.2
"""A counter or clock, which may begin again, goes back in no more than the first share of its
steps, and on in the second at least."""
Courses = Mapping[str, str | float | None]
"""Of each column by name: `RISES`, `TEXTS`, its value if it has one only, else None."""


def describe_columns(table: Table) -> Courses:
    """Return what each column of a table does, by name."""
    found: dict[str, str | float | None] = {}
    for name, column in zip(table.columns, table.values.T, strict=True):
        values = column[np.isfinite(column)]
        step = np.diff(values)
        if not len(values):
            found[name] = TEXTS
        elif not step.any():
            found[name] = float(values[0])
        else:
            back, on = sorted([(step > 0).mean(), (step < 0).mean()])
            found[name] = RISES if back <= _BACK and on >= _ON else None
    return found


def find_non_signals(files: Sequence[Courses]) -> dict[str, str]:
    """Return why columns are no signals, by name, from what they do in all files.

    Those that are `DEAD` may be sensors that failed.
    """
    why = {}
    for name in files[0]:
        its = {one.get(name) for one in files}
        if all(isinstance(value, float) for value in its):
            why[name] = LABELS if len(its) > 1 else DEAD
        elif len(its) == 1 and isinstance(reason := its.pop(), str):
            why[name] = reason
    return why


PASSED = 0.42
"""Share of the rate up to which the filter against aliasing passes all."""
AGREES = 0.01
"""Rates that differ by less are one."""
SLOWEST_S, SHORTEST_S, LONGEST_S = 0.2, 0.2, 3600
"""Longest step of a clock, and shortest and longest recording, that a unit of times may give."""


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


def find_rows_in_order(time_ms: Numbers) -> NDArray[np.bool_]:
    """Tell of each row (n,) whether it comes after all before it."""
    latest = np.maximum.accumulate(time_ms)
    return np.append(True, time_ms[1:] > latest[:-1])


def resample(time_ms: Numbers, values: Numbers, rate_hz: float, cubic: bool) -> Numbers:
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
    finer = find_oversampling(time_ms, rate_hz)
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


def find_oversampling(time_ms: Numbers, rate_hz: float) -> int:
    """Return how much finer a clock must be to be as fast as rows are in the mean."""
    rows_hz = 1000 * (len(time_ms) - 1) / float(time_ms[-1] - time_ms[0])
    return max(1, math.ceil(rows_hz / rate_hz - AGREES))


def find_unit(step: float, n: int, declared: str) -> str:
    """Return the unit in which `n` times, `step` apart, can be those of a touch.

    The declared one if it can be, or if none can, else the longest that can.
    """
    for unit in (declared, *UNITS_MS):
        step_s = step * UNITS_MS[unit] / 1000
        if step_s <= SLOWEST_S and SHORTEST_S <= n * step_s <= LONGEST_S:
            return unit
    return declared

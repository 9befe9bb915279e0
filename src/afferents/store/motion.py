"""Speed and force along a recording, as series: from logs, and as a store keeps them.

A fingertip on an arm slides at speeds that change. Its speed then is a series on a clock of its
own, from a log of speeds, from the arm's poses, or from the way of a drum. Of poses it is the
length of the derivative along their path, smoothed by a Savitzky-Golay filter (Anal. Chem. 1964,
36:1627): a parabola through `SMOOTHED_S` round each moment.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.store.drum_path import read_path
from afferents.store.log import LoggedFile
from afferents.store.responses import Responses, speed_of, steady_s

Values = NDArray[np.float64]

SMOOTHED_S = 0.2
FORCE, POSE = "force", "pose"
TELL_SPEED = frozenset({dims.SPEED_SERIES, POSE})
"""Logs that tell how fast a recording slides."""
NORMAL = "normal_force"
"""Attribute of a recording: the axis of force that is pressed along, with a minus if it is below 0
while pressed."""
_FEWEST = 5
_STEP_S = 0.02
_MM = {"m": 1000.0, "mm": 1.0}
_FARTHEST_M = 20.0
"""No arm slides so far in one recording."""
_MOST_BACK = 1 / 3
"""Share of a slide at 0 or below from which on a series is no speed along it."""


class Series(NamedTuple):
    """A quantity over time: `time_s` rising, (n,), and `values`, (n,); straight lines between."""

    time_s: Values
    values: Values

    def at(self, time_s: Values) -> Values:
        """Return the values at some times; NaN where the series does not reach."""
        return np.interp(time_s, *self, left=np.nan, right=np.nan)

    def along(self, time_s: Values) -> Values:
        """Return the integral from the series' beginning to some times."""
        steps = np.diff(self.time_s) * (self.values[1:] + self.values[:-1]) / 2
        whole = np.concatenate([[0.0], np.cumsum(steps)])
        n = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self.values) - 1)
        since = time_s - self.time_s[n]
        return np.asarray(whole[n] + since * (self.values[n] + self.at(time_s)) / 2)

    def over(self, start_s: Values, stop_s: Values) -> tuple[Values, Values, Values]:
        """Return mean, lowest and highest value from each start to its stop, (n,) each.

        NaN where the series does not reach.
        """
        mean = (self.along(stop_s) - self.along(start_s)) / (stop_s - start_s)
        ends = np.stack([self.at(start_s), self.at(stop_s)])
        low, high = ends.min(axis=0), ends.max(axis=0)
        spans = np.searchsorted(self.time_s, np.stack([start_s, stop_s], axis=1))
        for n, (first, last) in enumerate(spans):
            if last > first:
                between = self.values[first:last]
                low[n] = min(low[n], between.min())
                high[n] = max(high[n], between.max())
        gone = np.isnan(mean)
        low[gone] = high[gone] = np.nan
        return mean, low, high


def differentiate(time_s: Values, place: Values, where: object) -> Series:
    """Return the speed along a path: place (n, axis) over rising times, s; smoothed, see above.

    `where` they were found is for the error.

    Raises
    ------
    InputError
        If there are fewer places than the filter needs.
    """
    from scipy.signal import savgol_filter

    step_s = float(np.median(np.diff(time_s)))
    regular = np.arange(time_s[0], time_s[-1] + step_s / 2, step_s)
    if len(regular) < _FEWEST:
        raise InputError(
            f"{where}: expected {_FEWEST} rows or more to tell a speed from, found {len(regular)}"
        )
    points = min(max(_FEWEST, round(SMOOTHED_S / step_s) | 1), (len(regular) - 1) | 1)
    even = np.stack([np.interp(regular, time_s, axis) for axis in place.T])
    velocity = savgol_filter(even, points, 2, deriv=1, delta=step_s, axis=1)
    return Series(regular, np.linalg.norm(velocity, axis=0))


def add_motion(responses: Responses, logs: Sequence[LoggedFile]) -> Responses:
    """Return responses with the speed that their logs tell, and which way force is pressed.

    Parameters
    ----------
    responses
        Of a recording, with the variable of each log.
    logs
        Theirs: one named `speed` (mm/s) goes before one named `pose` (m or mm).

    Raises
    ------
    InputError
        If a log's clock is not that of the recording, or what it tells is no speed of a slide.
    """
    start, stop = steady_s(responses) or (0.0, length_s(responses))
    for each in logs:
        clock = responses[f"{each.name}_time"].values
        if clock[0] > stop or clock[-1] < start:
            raise InputError(
                f"{each.path}: expected times between {start:.2f} and {stop:.2f} s of the "
                f"recording, found {clock[0]:.2f} to {clock[-1]:.2f} s; if its clock is another "
                "than the recording's, name a press by which it is set, or take the file away"
            )
    named = {log.name: log for log in logs}
    if FORCE in named:
        force = responses[FORCE]
        n = min(2, force.shape[1] - 1)  # the axis that is pressed along, the third or the last
        sign = "-" if np.nanmedian(force.values[:, n]) < 0 else ""
        normal = f"{sign}{force[f'{FORCE}_axis'].values[n]}"
        responses = responses.assign_attrs({NORMAL: normal})
    if (log := named.get(dims.SPEED_SERIES, named.get(POSE))) is not None:
        found = responses[log.name]
        values = found.values.astype(np.float64)
        known = np.isfinite(values).all(axis=1)  # a cell may be empty
        series = _derive_speed(found[f"{log.name}_time"].values[known], values[known], log)
        _require_slide(series, steady_s(responses), log)
        variable = xr.DataArray(
            series.values.astype(np.float32),
            dims=dims.SPEED_TIME,
            coords={dims.SPEED_TIME: series.time_s},
            attrs={dims.UNITS: "mm/s", "told_by": log.name},
        )
        gone = [log.name, f"{log.name}_time", f"{log.name}_axis"]
        responses = responses.drop_vars(gone if log.name == dims.SPEED_SERIES else [])
        responses = responses.assign({dims.SPEED_SERIES: variable})
    return responses


def _derive_speed(time_s: Values, values: Values, log: LoggedFile) -> Series:
    if log.name == dims.SPEED_SERIES:
        speed = values[:, 0]
        return Series(time_s, -speed if np.median(speed) < 0 else speed)
    unit = log.units.split(",")[0].strip()
    if unit not in _MM:
        raise InputError(
            f"{log.path}: expected poses in m or mm (units 'm, rad'), found '{log.units}'"
        )
    place = values[:, :3]
    way_m = float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum()) * _MM[unit] / 1000
    if way_m > _FARTHEST_M:
        raise InputError(
            f"{log.path}: expected poses in {unit}, found a way of {way_m:.0f} m; if they are in "
            "mm, say so in a session file (units = 'mm, rad'), or divide them by 1000"
        )
    moved = differentiate(time_s, place, log.path)
    return Series(moved.time_s, moved.values * _MM[unit])


def _require_slide(series: Series, steady: tuple[float, float] | None, log: LoggedFile) -> None:
    """Refuse a speed that is 0 or below for much of a slide."""
    start, stop = steady or (series.time_s[0], series.time_s[-1])
    slid = series.values[(series.time_s >= start) & (series.time_s <= stop)]
    share = float((slid <= 0).mean()) if len(slid) else 1.0
    if share >= _MOST_BACK:
        raise InputError(
            f"{log.path}: expected speeds above 0 mm/s along the slide, found {share:.0%} of them "
            "at 0 or below; say with steady_s from when to when it slides"
        )


def length_s(responses: Responses) -> float:
    """Return how long a recording is, s."""
    if dims.TIME in responses.coords and responses.sizes[dims.TIME]:
        return float(responses[dims.TIME].values[-1])
    vibration = responses[dims.RA2]
    return float(vibration.sizes[dims.AUDIO_TIME] / vibration.attrs[dims.SAMPLE_RATE])


def force_sentences(normal: Iterable[str]) -> list[str]:
    """Return how many recordings are pressed against their axis of force, if any are."""
    turned = [axis for axis in normal if axis.startswith("-")]
    if not turned:
        return []
    return [
        f"{turned[0][1:]} is below 0 while the skin is pressed in {len(turned)} recordings: force "
        f"is taken as {turned[0]} there"
    ]


def speed_along(responses: Responses) -> Series | None:
    """Return a recording's speed as a series, mm/s; None where it is one number, or not known."""
    if dims.SPEED_SERIES in responses:
        found = responses[dims.SPEED_SERIES]
        return Series(found[dims.SPEED_TIME].values, found.values.astype(np.float64))
    if speed_of(responses) is None and (way := read_path(responses)) is not None:
        return differentiate(way.time_s, way.position_mm[:, None], responses.attrs["name"])
    return None


def force_along(responses: Responses) -> Series | None:
    """Return the force that presses, N, as a series; None where none is kept."""
    normal = str(responses.attrs.get(NORMAL, ""))
    if FORCE not in responses or not normal:
        return None
    force = responses[FORCE].sel({f"{FORCE}_axis": normal.lstrip("-")})
    values = (-1.0 if normal.startswith("-") else 1.0) * force.values.astype(np.float64)
    known = np.isfinite(values)  # a cell may be empty
    return Series(force[f"{FORCE}_time"].values[known], values[known])


def steady_values(series: Series, responses: Responses) -> Values:
    """Return the values of a series at regular moments of a recording's steady part."""
    start, stop = steady_s(responses) or (0.0, length_s(responses))
    values = series.at(np.arange(max(start, series.time_s[0]), stop, _STEP_S))
    return values[np.isfinite(values)]


def spread(values: Sequence[Values]) -> str:
    """Return between which values all but 1% at either end lie, in words."""
    low, high = np.quantile(np.concatenate(values), (0.01, 0.99))
    return f"{low:.3g} to {high:.3g}"


def series_sentences(recordings: Sequence[Responses]) -> list[str]:
    """Return how speed and force go in the steady parts of recordings that keep them as series."""
    found = []
    for what, along, unit in (("Speed", speed_along, "mm/s"), ("Force", force_along, "N")):
        kept = [(series, one) for one in recordings if (series := along(one)) is not None]
        if values := [steady_values(series, one) for series, one in kept]:
            found.append(f"{what} in {len(kept)} recordings: {spread(values)} {unit}.")
    return found


def has_speed(responses: Responses) -> bool:
    """Return whether it is known how fast a recording slides, as a number or as a series."""
    return (
        speed_of(responses) is not None
        or dims.SPEED_SERIES in responses
        or dims.DRUM_POSITION in responses
    )

"""What stands for lost markers in a response.

Filled are responses that are encoded for a model, offline (`evaluation.data`) and live
(`lab.live.touch`). Spikes, the viewer and exported files keep a lost marker at rest (0) instead.
"""

from functools import lru_cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims

_NEIGHBOURS, _REACH = 8, 1.6
"""A marker has at most this many neighbours, up to this many times as far as its third nearest."""


def fill(response: xr.DataArray) -> xr.DataArray:
    """Return the response with NaN filled from the markers round each lost one, in its own frame.

    A lost marker takes the mean of its neighbours, each weighted by one over its squared distance;
    within a hole, from the edge inwards. Skin is one sheet, so neighbours say more of a marker than
    where it was last seen, which may be far away by now. Only in a frame in which none of them was
    seen does it keep what it showed last; 0, the response at rest, before it was ever seen. No
    later frame is looked at: frames that come one by one are filled alike. (A tracker that finds
    out late that it had mistaken a marker takes back the frames before; live, they were used.)

    Parameters
    ----------
    response
        `(time, marker)` or `(time, marker, space)` with the markers' `row` and `column`, any unit.
        One over time without these (of the skin as a whole, or markers without places) is held
        instead; see `hold`.

    Returns
    -------
    xarray.DataArray
        A copy without NaN, whose dims begin with time and marker; name, coordinates and attributes
        kept.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    if dims.ROW not in response.coords or dims.MARKER not in response.dims:
        return hold(response)
    response = response.transpose(dims.TIME, dims.MARKER, ...)
    places = np.stack([response[name].values for name in (dims.ROW, dims.COLUMN)], axis=1)
    return response.copy(data=Filler(places).feed(response.values))


class Filler:
    """Fills what lost markers leave open, in frames that come one by one or many at a time.

    Parameters
    ----------
    places
        Of the markers, (marker, 2), by which they are neighbours; None to hold only. See `fill`
        and `hold`, which feed it a whole recording.
    """

    def __init__(self, places: NDArray[np.generic] | None = None) -> None:
        """Wait for the first frame."""
        self._places = places
        self._last: NDArray[np.floating] | None = None

    def feed(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the next frames, (time, marker, ...), without NaN, in an array of its own."""
        values = values.copy()
        if not np.isnan(values).any():
            self._last = values[-1:] if len(values) else self._last
            return values
        if self._places is not None:
            values = fill_frames(values, self._places)
        before = np.zeros_like(values[:1]) if self._last is None else self._last
        values = np.concatenate([before, values])
        frame = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
        last_seen = np.maximum.accumulate(np.where(np.isnan(values), 0, frame), axis=0)
        held = np.take_along_axis(values, last_seen, axis=0)[1:]
        self._last = held[-1:]
        return held


def hold(response: xr.DataArray) -> xr.DataArray:
    """Return the response with NaN filled: each marker keeps the value it was last seen with.

    Before a marker is first seen its response is 0, the response at rest; that holds for the
    first frame of RA-I too. This is what the published tracker amounts to (it keeps a lost marker
    where it was; RA-I is then 0 rather than held).

    Parameters
    ----------
    response
        `(time, marker)`, `(time, marker, space)`, or another one over time, any unit.

    Returns
    -------
    xarray.DataArray
        A filled copy without NaN; name, coordinates and attributes kept.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    usual = (dims.MARKER, dims.SPACE)
    others = [str(dim) for dim in response.dims if dim not in (dims.TIME, *usual)]
    needed = (dims.TIME, *others) if others else (dims.TIME, *usual)[: max(2, response.ndim)]
    response = dims.require(response, needed, str(response.name))
    return response.copy(data=Filler().feed(response.values))


def fill_frames(values: NDArray[np.floating], places: NDArray[np.generic]) -> NDArray[np.floating]:
    """Return values (time, marker, ...) whose NaN are filled from neighbours in the same frame.

    Each frame is filled by itself, with the same operations in the same order whatever the number
    of frames. NaN stay in a frame in which no marker is seen that others could be filled from.

    Parameters
    ----------
    places
        Of the markers, (marker, 2), in any unit of length.
    """
    lost = np.isnan(values)
    (frames,) = np.nonzero(lost.any(axis=tuple(range(1, values.ndim))))
    if not len(frames):
        return values
    neighbour, weight = _weigh_neighbours(np.asarray(places, np.float64).tobytes())
    weight = weight.astype(values.dtype).reshape(*weight.shape, *[1] * (values.ndim - 2))
    some = values[frames]
    while True:
        total, seen = np.zeros_like(some), np.zeros_like(some)
        for rank in range(neighbour.shape[1]):
            near, by = some[:, neighbour[:, rank]], weight[:, rank]
            there = ~np.isnan(near)
            total += np.where(there, near * by, 0)
            seen += there * by
        found = np.isnan(some) & (seen > 0)
        if not found.any():
            break
        some[found] = total[found] / seen[found]
    filled = values.copy()
    filled[frames] = some
    return filled


@lru_cache(maxsize=8)
def _weigh_neighbours(places: bytes) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return which markers are next to each, (marker, rank), and weights; 0 for those too far."""
    from scipy.spatial import cKDTree

    points = np.frombuffer(places).reshape(-1, 2)
    n = min(_NEIGHBOURS, len(points) - 1)
    if n < 1:
        return np.zeros((len(points), 0), np.intp), np.zeros((len(points), 0))
    distance, neighbour = (found[:, 1:] for found in cKDTree(points).query(points, n + 1))
    near = distance <= _REACH * distance[:, : min(3, n)].max(axis=1, keepdims=True)
    return neighbour, np.where(near, distance**-2.0, 0.0)

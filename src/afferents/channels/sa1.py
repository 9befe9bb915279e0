"""SA-I: how far each marker stands from its place at rest (Eq. 1)."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import require_dims
from afferents.core import dims
from afferents.core.errors import InputError


class Sa1(Channel):
    """SA-I: how far each marker stands from its place at rest, px."""

    name, title, made_of = dims.SA1, "SA-I", dims.SA1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return SA-I `(time, marker)` as it was extracted, px."""
        return recording[dims.SA1]

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return SA-I of one frame, (marker,), px."""
        return distance(now)


def distance(skin: Skin) -> NDArray[np.floating]:
    """Return how far each marker of a frame stands from rest, (marker,), px."""
    return np.asarray(((skin.position - skin.rest) ** 2).sum(axis=1) ** 0.5)


def sa1(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the artificial SA-I response, Eq. 1: `SA[n,t] = |p[n,t] - p[n,rest]|`.

    Parameters
    ----------
    position
        `(time, marker, space)`, px; NaN where a marker was lost.
    rest_position
        `(marker, space)`, px; the same markers in the same order.

    Returns
    -------
    xarray.DataArray
        `sa1` `(time, marker)`, px, never negative; NaN where the marker was lost.

    Raises
    ------
    InputError
        If a dim is missing, or the two do not hold the same markers.
    """
    position = require_dims(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    rest = require_dims(rest_position, (dims.MARKER, dims.SPACE), dims.REST_POSITION)
    _require_same_markers(position, rest)
    squared = (position - rest) ** 2
    distance: xr.DataArray = squared.sum(dims.SPACE, skipna=False) ** 0.5
    return distance.rename(dims.SA1).assign_attrs(
        {dims.UNITS: dims.PIXELS, "long_name": "SA-I, displacement of the marker from rest"}
    )


def _require_same_markers(position: xr.DataArray, rest: xr.DataArray) -> None:
    n, n_rest = position.sizes[dims.MARKER], rest.sizes[dims.MARKER]
    if n != n_rest:
        raise InputError(dims.REST_POSITION, f"{n} markers as in {dims.POSITION}", f"{n_rest}")
    for dim in (dims.MARKER, dims.SPACE):
        if dim in position.indexes and dim in rest.indexes:
            same = position.indexes[dim].equals(rest.indexes[dim])
            if not same:
                raise InputError(
                    dims.REST_POSITION, f"the {dim} labels of {dims.POSITION}", "others"
                )

"""SA-I with its direction: the displacement of each marker, whose length the paper takes.

Natural afferents of this kind prefer directions (Birznieks et al., J. Neurosci. 2001, 21:8222).
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import named, require_dims
from afferents.core import dims


class Sa1Vector(Channel):
    """The displacement of each marker from rest, px."""

    name, title, made_of = dims.SA1_VECTOR, "SA-I vector", dims.POSITION

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the displacement `(time, marker, space)`, px."""
        return sa1_vector(recording[dims.POSITION], recording[dims.REST_POSITION])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return the displacement in one frame, (marker, space), px."""
        return displacement(now)


def displacement(skin: Skin) -> NDArray[np.float32]:
    """Return the displacement of each marker in one frame, (marker, space), px.

    Of float32 positions, as a store keeps them.
    """
    return np.asarray(skin.position.astype(np.float32) - skin.rest.astype(np.float32))


def sa1_vector(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the displacement of each marker from rest, whose length is SA-I.

    Parameters
    ----------
    position, rest_position
        `(time, marker, space)` and `(marker, space)`, px; NaN where a marker was lost.

    Returns
    -------
    xarray.DataArray
        `sa1_vector` `(time, marker, space)`, px.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    position = require_dims(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    rest = require_dims(rest_position, (dims.MARKER, dims.SPACE), dims.REST_POSITION)
    return named(position - rest, dims.SA1_VECTOR, dims.PIXELS)

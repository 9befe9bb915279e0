"""RA-I with its direction: the step of each marker from frame to frame."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import change, named, require_dims
from afferents.channels.sa1_vector import displacement, sa1_vector
from afferents.core import dims


class Ra1Vector(Channel):
    """The step of each marker since the frame before, px/frame."""

    name, title, made_of, lookback = dims.RA1_VECTOR, "RA-I vector", dims.POSITION, 1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the steps `(time, marker, space)`, px/frame."""
        return ra1_vector(sa1_vector(recording[dims.POSITION], recording[dims.REST_POSITION]))

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return the step in one frame, (marker, space), px/frame."""
        return None if before is None else displacement(now) - displacement(before)


def ra1_vector(position: xr.DataArray) -> xr.DataArray:
    """Return the step of each marker since the frame before.

    Parameters
    ----------
    position
        `(time, marker, space)`, px, from rest or anywhere.

    Returns
    -------
    xarray.DataArray
        `ra1_vector` `(time, marker, space)`, px/frame, NaN in the first frame.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    place = require_dims(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.SA1_VECTOR)
    return named(change(place), dims.RA1_VECTOR, dims.PIXELS_PER_FRAME)

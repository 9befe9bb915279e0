"""The part of RA-I that the paper's length is blind to: steps round the place at rest."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import change, named, require_dims
from afferents.channels.sa1_vector import displacement, sa1_vector
from afferents.core import dims

_NO_DIRECTION_PX = 1e-3
"""Closer to rest than this a marker has no direction from it."""


class Ra1Circumferential(Channel):
    """The part of each marker's step that goes round its place at rest, px/frame."""

    name, title = dims.RA1_CIRCUMFERENTIAL, "RA-I circumferential"
    made_of, lookback = dims.POSITION, 1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the steps `(time, marker)`, px/frame."""
        moved = sa1_vector(recording[dims.POSITION], recording[dims.REST_POSITION])
        return ra1_circumferential(moved)

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return the step in one frame, (marker,), px/frame."""
        if before is None:
            return None
        earlier = displacement(before)
        (x, y), (dx, dy) = earlier.T, (displacement(now) - earlier).T
        return np.asarray((x * dy - y * dx) / np.maximum(np.hypot(x, y), _NO_DIRECTION_PX))


def ra1_circumferential(moved: xr.DataArray) -> xr.DataArray:
    """Return the part of each marker's step that goes round its place at rest.

    It is what RA-I is blind to: RA-I changes with the distance from rest alone.

    Parameters
    ----------
    moved
        `(time, marker, space)`, px, from rest.

    Returns
    -------
    xarray.DataArray
        `ra1_circumferential` `(time, marker)`, px/frame, from +x towards +y positive; NaN in the
        first frame, and 0 where the marker was at rest.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    place = require_dims(moved, (dims.TIME, dims.MARKER, dims.SPACE), dims.SA1_VECTOR)
    before, step = place.shift({dims.TIME: 1}), change(place)
    x, y = (before.isel({dims.SPACE: i}) for i in (0, 1))
    dx, dy = (step.isel({dims.SPACE: i}) for i in (0, 1))
    round_it = (x * dy - y * dx) / np.maximum(np.hypot(x, y), _NO_DIRECTION_PX)
    around = round_it.drop_vars(dims.SPACE, errors="ignore")
    return named(around, dims.RA1_CIRCUMFERENTIAL, dims.PIXELS_PER_FRAME)

"""SA-I and RA-I with their directions, which the paper's two lengths leave out.

RA-I as the paper has it (Eq. 2) is blind to the sign of a change, and to a marker that circles its
place at rest. These are not; natural afferents of either kind also prefer directions (Birznieks et
al., J. Neurosci. 2001, 21:8222).
"""

import numpy as np
import xarray as xr

from afferents.channels.checks import require_dims
from afferents.core import dims

_NO_DIRECTION_PX = 1e-3
"""Closer to rest than this a marker has no direction from it."""


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
    return _named(position - rest, dims.SA1_VECTOR, dims.PIXELS)


def ra1_signed(sa1: xr.DataArray) -> xr.DataArray:
    """Return how SA-I changes from frame to frame, with its sign: Eq. 2 without the bars.

    Parameters and errors as `ra1`; `ra1_signed` `(time, marker)`, px/frame, NaN in the first frame.
    """
    response = require_dims(sa1, (dims.TIME, dims.MARKER), dims.SA1)
    return _named(_change(response), dims.RA1_SIGNED, dims.PIXELS_PER_FRAME)


def ra1_vector(displacement: xr.DataArray) -> xr.DataArray:
    """Return the step of each marker since the frame before.

    Parameters
    ----------
    displacement
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
    place = require_dims(displacement, (dims.TIME, dims.MARKER, dims.SPACE), dims.SA1_VECTOR)
    return _named(_change(place), dims.RA1_VECTOR, dims.PIXELS_PER_FRAME)


def ra1_circumferential(displacement: xr.DataArray) -> xr.DataArray:
    """Return the part of each marker's step that goes round its place at rest.

    It is what RA-I is blind to: RA-I changes with the distance from rest alone.

    Parameters
    ----------
    displacement
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
    place = require_dims(displacement, (dims.TIME, dims.MARKER, dims.SPACE), dims.SA1_VECTOR)
    before, step = place.shift({dims.TIME: 1}), _change(place)
    x, y = (before.isel({dims.SPACE: i}) for i in (0, 1))
    dx, dy = (step.isel({dims.SPACE: i}) for i in (0, 1))
    round_it = (x * dy - y * dx) / np.maximum(np.hypot(x, y), _NO_DIRECTION_PX)
    around = round_it.drop_vars(dims.SPACE, errors="ignore")
    return _named(around, dims.RA1_CIRCUMFERENTIAL, dims.PIXELS_PER_FRAME)


def _change(response: xr.DataArray) -> xr.DataArray:
    return response - response.shift({dims.TIME: 1})


def _named(response: xr.DataArray, name: str, unit: str) -> xr.DataArray:
    return response.rename(name).assign_attrs({dims.UNITS: unit})

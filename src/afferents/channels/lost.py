"""Filling what lost markers leave open. Nothing fills by itself: callers ask for it."""

import numpy as np
import xarray as xr

from afferents.channels.checks import require_dims
from afferents.core import dims
from afferents.core.pixels import fill_frames


def fill(response: xr.DataArray) -> xr.DataArray:
    """Return the response with NaN filled from the markers round each lost one, in its own frame.

    A lost marker takes the mean of its neighbours, each weighted by one over its squared distance;
    within a hole, from the edge inwards. Skin is one sheet, so neighbours say more of a marker than
    where it was last seen, which may be far away by now. Only in a frame in which none of them was
    seen does it keep what it showed last; 0, the response at rest, before it was ever seen. No
    later frame is looked at: frames that come one by one are filled alike.

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
    filled = fill_frames(response.values, places)
    return hold(response.copy(data=filled))


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
    response = require_dims(response, needed, str(response.name))
    values = response.values
    frame = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last_seen = np.maximum.accumulate(np.where(np.isnan(values), 0, frame), axis=0)
    held = np.take_along_axis(values, last_seen, axis=0)
    return response.copy(data=np.nan_to_num(held, nan=0.0))

"""Filling what lost markers leave open. Nothing fills by itself: callers ask for it."""

import numpy as np
import xarray as xr

from afferents.channels.checks import require_dims
from afferents.core import dims


def hold(response: xr.DataArray) -> xr.DataArray:
    """Return the response with NaN filled: each marker keeps the value it was last seen with.

    Before a marker is first seen its response is 0, the response at rest; that holds for the
    first frame of RA-I too. A network can't take NaN, and this is what the published tracker
    amounts to (it keeps a lost marker where it was; RA-I is then 0 rather than held).

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

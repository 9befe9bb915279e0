"""RA-I: how much the SA-I response changes from frame to frame (Eq. 2); and marker speed.

RA-I as the paper defines it is blind to a marker that circles its place at rest, and counts px
a frame, not a second. The speed of the marker itself is `marker_speed`, another function.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import require_dims
from afferents.channels.sa1 import distance
from afferents.core import dims
from afferents.core.errors import InputError

MARKER_SPEED = "marker_speed"


class Ra1(Channel):
    """RA-I: how much SA-I changes from frame to frame, px/frame."""

    name, title, made_of, lookback = dims.RA1, "RA-I", dims.SA1, 1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return RA-I `(time, marker)`, px/frame."""
        return ra1(recording[dims.SA1])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return RA-I of one frame, (marker,), px/frame."""
        return None if before is None else np.abs(distance(now) - distance(before))


def ra1(sa1: xr.DataArray) -> xr.DataArray:
    """Return the artificial RA-I response, Eq. 2: `RA[n,t] = |SA[n,t] - SA[n,t-1]|`.

    Parameters
    ----------
    sa1
        `(time, marker)`, px, one row a frame of the video; NaN where a marker was lost.

    Returns
    -------
    xarray.DataArray
        `ra1` `(time, marker)`, px/frame, never negative. The first frame is NaN, for nothing
        comes before it (the published code takes SA itself there); so is a frame in which,
        or before which, the marker was lost.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    response = require_dims(sa1, (dims.TIME, dims.MARKER), dims.SA1)
    change: xr.DataArray = abs(response - _frame_before(response))
    return change.rename(dims.RA1).assign_attrs(
        {dims.UNITS: dims.PIXELS_PER_FRAME, "long_name": "RA-I, change of SA-I in one frame"}
    )


def marker_speed(position: xr.DataArray) -> xr.DataArray:
    """Return how fast each marker moves, from the true frame times.

    Parameters
    ----------
    position
        `(time, marker, space)`, px, with the coordinate `time` in s; NaN where lost.

    Returns
    -------
    xarray.DataArray
        `marker_speed` `(time, marker)`, px/s, the mean speed since the frame before. The first
        frame is NaN; so is a frame in which, or before which, the marker was lost.

    Raises
    ------
    InputError
        If a dim or the coordinate `time` is missing, or if times do not rise.
    """
    position = require_dims(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    step_s = _steps(position)
    squared = (position - _frame_before(position)) ** 2
    speed: xr.DataArray = squared.sum(dims.SPACE, skipna=False) ** 0.5 / step_s
    return speed.rename(MARKER_SPEED).assign_attrs(
        {dims.UNITS: dims.PIXELS_PER_SECOND, "long_name": "speed of the marker in the image"}
    )


def _frame_before(response: xr.DataArray) -> xr.DataArray:
    """Return each frame's predecessor in its place, NaN for the first."""
    return response.shift({dims.TIME: 1})


def _steps(position: xr.DataArray) -> xr.DataArray:
    """Return the time since the frame before, `(time)`, s, NaN for the first."""
    if dims.TIME not in position.coords:
        raise InputError(dims.POSITION, f"the coordinate '{dims.TIME}' in s", "none")
    time_s = position[dims.TIME].values
    step_s = np.diff(time_s)
    if (stuck := np.flatnonzero(step_s <= 0)).size:
        frame = int(stuck[0]) + 1
        raise InputError(
            dims.POSITION,
            "times that rise",
            f"{time_s[frame]} s at frame {frame} after {time_s[frame - 1]} s",
        )
    steps = np.concatenate([[np.nan], step_s])[: len(time_s)]
    return xr.DataArray(steps.astype(position.dtype), dims=dims.TIME)

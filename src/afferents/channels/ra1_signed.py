"""RA-I with its sign: whether a marker goes away from rest or comes back."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import change, named, require_dims
from afferents.channels.sa1 import distance
from afferents.core import dims


class Ra1Signed(Channel):
    """How SA-I changes from frame to frame, with its sign, px/frame."""

    name, title, made_of, lookback = dims.RA1_SIGNED, "RA-I signed", dims.SA1, 1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the change `(time, marker)`, px/frame."""
        return ra1_signed(recording[dims.SA1])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return the change in one frame, (marker,), px/frame."""
        return None if before is None else distance(now) - distance(before)


def ra1_signed(sa1: xr.DataArray) -> xr.DataArray:
    """Return how SA-I changes from frame to frame, with its sign: Eq. 2 without the bars.

    Parameters and errors as `ra1`; `ra1_signed` `(time, marker)`, px/frame, NaN in the first frame.
    """
    response = require_dims(sa1, (dims.TIME, dims.MARKER), dims.SA1)
    return named(change(response), dims.RA1_SIGNED, dims.PIXELS_PER_FRAME)

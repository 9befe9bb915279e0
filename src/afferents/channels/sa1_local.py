"""SA-I without the global shear: what each marker moves beside the skin as a whole."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import named
from afferents.channels.sa1_vector import displacement, sa1_vector
from afferents.channels.shear import affine_field, fitted_plane
from afferents.core import dims


class Sa1Local(Channel):
    """The displacement of each marker from rest less the global shear, px."""

    name, title, made_of = dims.SA1_LOCAL, "SA-I vector without shear", dims.POSITION

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return what is left of the displacement `(time, marker, space)`, px."""
        return sa1_local(recording[dims.POSITION], recording[dims.REST_POSITION])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return what is left in one frame, (marker, space), px."""
        moved = displacement(now)
        plane = fitted_plane(moved[np.newaxis], now.rest).field[0]
        return np.asarray(moved - plane.astype(moved.dtype))


def sa1_local(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the displacement of each marker from rest, without that of the global shear.

    Parameters
    ----------
    position, rest_position
        `(time, marker, space)` and `(marker, space)`, px; NaN where a marker was lost.

    Returns
    -------
    xarray.DataArray
        `sa1_local` `(time, marker, space)`, px: the residual of the plane of `global_shear`.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    moved = sa1_vector(position, rest_position)
    return named(moved - affine_field(position, rest_position), dims.SA1_LOCAL, dims.PIXELS)

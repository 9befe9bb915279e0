"""What channels share: their dims are checked, changes from frame to frame, names and units."""

import xarray as xr

from afferents.core import dims
from afferents.core.errors import InputError


def require_dims(array: xr.DataArray, needed: tuple[str, ...], name: str) -> xr.DataArray:
    """Return `array` with its dims in the order `needed`.

    Raises
    ------
    InputError
        Naming the dims that are missing or too many.
    """
    if set(array.dims) == set(needed):
        return array.transpose(*needed)
    missing = [dim for dim in needed if dim not in array.dims]
    fault = f"{', '.join(missing)} missing" if missing else "too many"
    raise InputError(name, f"the dims {needed}", f"{array.dims} ({fault})")


def change(response: xr.DataArray) -> xr.DataArray:
    """Return how much a response `(time, ...)` changes from frame to frame, NaN in the first."""
    return response - response.shift({dims.TIME: 1})


def named(response: xr.DataArray, name: str, unit: str) -> xr.DataArray:
    """Return a response with its name and unit."""
    return response.rename(name).assign_attrs({dims.UNITS: unit})

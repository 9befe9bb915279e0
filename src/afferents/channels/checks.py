"""Checks at the door of a channel: the named dims are there, no others."""

import xarray as xr

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

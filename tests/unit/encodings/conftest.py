"""Responses of one recording, as encodings take them."""

import numpy as np
import xarray as xr


def respond(values, row=None, column=None, dims=("time", "marker", "space")):
    """Return values by frame, 90 a second, of markers at these places where they have any."""
    values = np.asarray(values, np.float32)
    coords = {"time": np.arange(len(values)) / 90}
    if row is not None:
        coords |= {"row": ("marker", row), "column": ("marker", column)}
    about = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0, "units": "px"}
    return xr.DataArray(values, coords, dims[: values.ndim], name="sa1", attrs=about)

"""Tactile images of a response: what its markers show, laid out in rows and columns."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.markers.places import images_of


def tactile_images(response: xr.DataArray) -> NDArray[np.float32]:
    """Lay the markers of every frame out as an image.

    Parameters
    ----------
    response
        SA-I or RA-I `(time, marker)` with the coordinates `row` and `column` on `marker`.

    Returns
    -------
    Array of shape (time, row, column), float32, in the response's unit. On a square grid row is
    the rank of a marker in y, column its rank in x; the published arrays are the transpose. Of
    other layouts pixels are interpolated between markers; see `markers.places`.

    Raises
    ------
    InputError
        If the markers have no places in an image, or if lost markers (NaN) were not filled before.
    """
    where = name_of(response)
    if dims.ROW not in response.coords or dims.COLUMN not in response.coords:
        raise InputError(
            f"{where}: expected markers whose places are known (coordinates row and column), "
            "found a layout that no sensor file describes; calibrate the sensor and extract "
            "again, or use the vibrotactile models"
        )
    require_filled(response)
    values = response.transpose(dims.TIME, dims.MARKER).values
    return images_of(values, response[dims.ROW].values, response[dims.COLUMN].values)


def require_filled(response: xr.DataArray) -> None:
    """Refuse a response with markers that are lost (NaN).

    Raises
    ------
    InputError
        If there is one.
    """
    if bool(response.isnull().any()):
        raise InputError(
            f"{name_of(response)}: expected lost markers filled, found NaN; fill them with "
            "channels.fill"
        )


def name_of(response: xr.DataArray) -> str:
    """Return which response of which recording it is, for errors."""
    return f"{response.name} of {response.attrs.get('name', 'a recording')}"


def image_runs(response: xr.DataArray, frames: slice, length: int) -> NDArray[np.float32]:
    """Return runs of tactile images that follow each other; a last incomplete one is dropped.

    Parameters
    ----------
    response
        `(time, marker)` or `(time, marker, space)`; see `tactile_images`.
    frames
        Frames that the cut keeps.
    length
        Images of a run.

    Returns
    -------
    Shape (run, frame, component, row, column), in the response's unit.
    """
    images = component_images(response.isel({dims.TIME: frames}))
    n = len(images) // length
    return images[: n * length].reshape(n, length, *images.shape[1:])


def component_images(response: xr.DataArray) -> NDArray[np.float32]:
    """Return tactile images (time, component, row, column) of a length or of a vector."""
    if dims.SPACE not in response.dims:
        return tactile_images(response)[:, None]
    parts = (response.isel({dims.SPACE: i}, drop=True) for i in range(response.sizes[dims.SPACE]))
    return np.stack([tactile_images(part) for part in parts], axis=1)

"""The operator that makes tactile images: pixels of what the markers of a layout show.

It is linear, made once for a layout, sparse, and applied to a whole recording by one product. A
pixel within the markers' hull is interpolated linearly between the three markers of the Delaunay
triangle that it lies in (Lawson, Software for C1 surface interpolation, in Mathematical Software
III, 1977); a pixel outside is 0. A marker that stands on a pixel is that pixel, so on a square grid
the operator is the identity; there nothing is computed at all, markers are put where they belong.

Linear, since splines and natural neighbours come no nearer to what the rig's skin does where
markers are as noisy as tracking leaves them (`docs/layouts.md`, by `scripts/compare_images.py`).
"""

from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError

Floats = NDArray[np.float32]
Places = NDArray[np.generic]
"""Rows or columns of markers: whole numbers on a square grid, any on other layouts."""

_INSIDE = 1e-6
"""Pixels may lie this far outside a triangle, in its own coordinates: places are rounded."""
_LEAST_WEIGHT = 1e-5


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
    other layouts pixels are interpolated between markers; see the operator above.

    Raises
    ------
    InputError
        If the markers have no places in an image, or if lost markers (NaN) were not filled before.
    """
    where = name_of(response)
    if dims.ROW not in response.coords or dims.COLUMN not in response.coords:
        raise InputError(
            where,
            "markers whose places are known (coordinates row and column)",
            "a layout that no sensor file describes",
            "calibrate the sensor and extract again, or use the vibrotactile models",
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
            name_of(response), "lost markers filled", "NaN", "fill them with channels.hold"
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


def images_of(values: NDArray[np.floating], row: Places, column: Places) -> Floats:
    """Make images of what markers show.

    Parameters
    ----------
    values
        Shape (n, marker), without NaN, in any unit.
    row, column
        Where each marker stands in the image, (marker,): integers on a square grid, pixels and
        parts of pixels on other layouts.

    Returns
    -------
    Shape (n, row, column), float32, in the values' unit.
    """
    shape = image_shape(row, column)
    if _is_grid(row):
        images = np.zeros((len(values), *shape), dtype=np.float32)
        images[:, row, column] = values
        return images
    operator = _operator(row.tobytes(), column.tobytes())
    flat = operator @ np.asarray(values, np.float32).T
    return np.ascontiguousarray(flat.T).reshape(len(values), *shape)


def image_shape(row: Places, column: Places) -> tuple[int, int]:
    """Return rows and columns of the image that markers at these places make."""
    if _is_grid(row):
        return int(row.max()) + 1, int(column.max()) + 1
    # The middle of the markers is that of the image.
    rows, columns = (round(float(place.min()) + float(place.max())) + 1 for place in (row, column))
    return rows, columns


def covered(row: Places, column: Places) -> NDArray[np.bool_]:
    """Return which pixels (row, column) show markers; the others are always 0."""
    return np.asarray(images_of(np.ones((1, len(row))), row, column)[0] > 0)


def _is_grid(row: Places) -> bool:
    return np.issubdtype(row.dtype, np.integer)


@lru_cache(maxsize=8)
def _operator(row: bytes, column: bytes) -> Any:
    """Return the operator (pixel, marker), sparse float32, from places as bytes of float64."""
    from scipy.sparse import csr_array
    from scipy.spatial import Delaunay

    places = np.stack([np.frombuffer(row), np.frombuffer(column)], axis=1)
    shape = image_shape(*places.T)
    pixels = np.indices(shape).reshape(2, -1).T.astype(np.float64)
    mesh = Delaunay(places)
    at = mesh.find_simplex(pixels, tol=_INSIDE)
    (pixel,) = np.nonzero(at >= 0)
    frame = mesh.transform[at[pixel]]
    two = np.einsum("nij,nj->ni", frame[:, :2], pixels[pixel] - frame[:, 2])
    weight = np.concatenate([two, 1 - two.sum(axis=1, keepdims=True)], axis=1)
    weight = np.where(weight < _LEAST_WEIGHT, 0, weight)
    weight /= weight.sum(axis=1, keepdims=True)
    marker = mesh.simplices[at[pixel]]
    entries = (weight.ravel().astype(np.float32), (np.repeat(pixel, 3), marker.ravel()))
    operator = csr_array(entries, shape=(len(pixels), len(places)))
    operator.eliminate_zeros()
    return operator

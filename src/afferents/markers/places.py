"""Where markers of any layout stand in a tactile image, and the pixels made of what they show."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, Delaunay, QhullError

from afferents.errors import InputError
from afferents.markers.detect import Positions

FEWEST = 4
_STEPS = 1024
"""Places are whole multiples of 1 / 1024 of a pixel, so that float32 holds them exactly."""
Floats = NDArray[np.float32]
Places = NDArray[np.generic]
"""Rows or columns of markers: whole numbers on a square grid, any on other layouts."""

_INSIDE = 1e-6
"""Pixels may lie this far outside a triangle, in its own coordinates: places are rounded."""
_LEAST_WEIGHT = 1e-5


def image_places(
    position: Positions, size: tuple[int, int] | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lay an upright, evenly spaced image over the markers of a layout.

    Parameters
    ----------
    position
        Where a sensor's markers are at rest, shape (n, 2), px.
    size
        Rows and columns; None for pixels as large as a marker's share of the skin, as many as lie
        within the layout. Given, they are as small as to just reach from edge to edge.

    Returns
    -------
    tuple
        Row and column of each marker, both (n,). Whole numbers are pixels. The image is as high and
        wide as its middle, which is that of the markers, is far from its corner: (rows - 1) / 2 and
        (columns - 1) / 2.

    Raises
    ------
    InputError
        If the markers are too few for an image, or lie in a line.
    """
    try:
        if len(position) < FEWEST:
            raise QhullError
        hull, mesh = ConvexHull(position), Delaunay(position)
    except QhullError:
        expected = f"{FEWEST} markers or more, not in a line"
        raise InputError(
            f"the sensor's markers: expected {expected}, found {len(position)}"
        ) from None
    low, high = hull.min_bound, hull.max_bound
    if size is None:
        # A triangulation has two triangles a marker, but for those at the edge.
        pitch = np.sqrt(2 * hull.volume / len(mesh.simplices))
        shape = np.floor((high - low) / pitch + 1e-6) + 1
    else:
        shape = np.array(size[::-1], np.float64)
        pitch = ((high - low) / np.maximum(shape - 1, 1)).max()
    place = (position - (low + high) / 2) / pitch + (shape - 1) / 2
    column, row = (np.rint(place * _STEPS) / _STEPS).T
    return row, column


def make_images(values: NDArray[np.floating], row: Places, column: Places) -> Floats:
    """Make images of what markers show: by an operator, linear and sparse, made once for a layout.

    A pixel within the markers' hull is interpolated linearly between the three markers of the
    Delaunay triangle that it lies in (Lawson, Software for C1 surface interpolation, in
    Mathematical Software III, 1977); a pixel outside is 0. A marker that stands on a pixel is that
    pixel; on a square grid, where all do, nothing is computed, markers are put where they belong.

    Linear, since splines and natural neighbours come no nearer to what the rig's skin does where
    markers are as noisy as tracking leaves them (`docs/tracking.md`, by
    `studies/compare_images.py`). What lost markers leave open is filled before (`filling`).

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
    if row.dtype.kind in "iu":
        images = np.zeros((len(values), *shape), dtype=np.float32)
        images[:, row, column] = values
        return images
    operator = _make_operator(row.tobytes(), column.tobytes())
    flat = operator @ np.asarray(values, np.float32).T
    return np.ascontiguousarray(flat.T).reshape(len(values), *shape)


def image_shape(row: Places, column: Places) -> tuple[int, int]:
    """Return rows and columns of the image that markers at these places make."""
    if row.dtype.kind in "iu":
        return int(row.max()) + 1, int(column.max()) + 1
    # The middle of the markers is that of the image.
    rows, columns = (round(float(place.min()) + float(place.max())) + 1 for place in (row, column))
    return rows, columns


def covered(row: Places, column: Places) -> NDArray[np.bool_]:
    """Return which pixels (row, column) show markers; the others are always 0."""
    return np.asarray(make_images(np.ones((1, len(row))), row, column)[0] > 0)


@lru_cache(maxsize=8)
def _make_operator(row: bytes, column: bytes) -> Any:
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

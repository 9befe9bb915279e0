"""Where the markers of any layout stand in a tactile image, in rows and columns."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, Delaunay, QhullError

from afferents.core.errors import InputError
from afferents.markers.detect import Positions

FEWEST = 4
_STEPS = 1024
"""Places are whole multiples of 1 / 1024 of a pixel, so that float32 holds them exactly."""


class ImagePlaces(NamedTuple):
    """Places of n markers in an image of rows and columns, both (n,).

    Whole numbers are pixels. The image is as high and wide as its middle, which is that of the
    markers, is far from its corner: (rows - 1) / 2 and (columns - 1) / 2.
    """

    row: NDArray[np.float64]
    column: NDArray[np.float64]


def image_places(position: Positions, size: tuple[int, int] | None = None) -> ImagePlaces:
    """Lay an upright, evenly spaced image over the markers of a layout.

    Parameters
    ----------
    position
        Where a sensor's markers are at rest, shape (n, 2), px.
    size
        Rows and columns; None for pixels as large as a marker's share of the skin, as many as lie
        within the layout. Given, they are as small as to just reach from edge to edge.

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
        raise InputError("the sensor's markers", expected, f"{len(position)}") from None
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
    return ImagePlaces(row, column)

"""More blobs than a square layout has markers: which of them are none."""

import numpy as np
from numpy.typing import NDArray

from afferents.markers.detect import Positions, spacing_px
from afferents.markers.grid import Grid, places_of, smooth
from afferents.markers.suspects import beyond_layout

MOST_FALSE = 0.05
"""With more blobs too many than this share of a layout, it is another sensor or a picture gone
wrong."""
GATE_SHARE = 0.4
"""A marker lies within this share of the spacing of where smooth rows and columns meet."""


def without_false_markers(position: Positions, rows: int, columns: int) -> Positions:
    """Leave out of too many blobs those that the layout has no place for.

    What lies apart from all others goes first: reflections beyond the rim. Of the others, each
    place of the `rows` x `columns` that hold most keeps the blob that lies nearest to where smooth
    rows and columns meet.

    Parameters
    ----------
    position
        Shape (n, 2), px, in any order.

    Returns
    -------
    Positions
        In the same order; as they were where there are not too many.
    """
    if len(position) > rows * columns:
        position = position[~beyond_layout(position)]
    if len(position) <= rows * columns:
        return position
    row, column = places_of(position)
    kept = np.flatnonzero(_fullest(row, rows) & _fullest(column, columns))
    for _ in range(2):  # what the first leaves out bends the rows and columns no longer
        meet = smooth(position[kept], Grid(row[kept], column[kept], float("nan")))
        off = meet(np.stack([column[kept], row[kept]], axis=1)) - position[kept]
        away = np.hypot(*off.T)
        near = away <= GATE_SHARE * spacing_px(position)
        kept = _one_a_place(kept[near], away[near], row * (column.max() + 1) + column)
    return np.asarray(position[kept])


def _fullest(place: NDArray[np.intp], n: int) -> NDArray[np.bool_]:
    """Say which blobs lie in the n neighbouring rows (or columns) that hold most."""
    if place.max() < n:
        return np.ones(len(place), dtype=bool)
    first = int(np.convolve(np.bincount(place), np.ones(n, dtype=int), "valid").argmax())
    inside: NDArray[np.bool_] = (place >= first) & (place < first + n)
    return inside


def _one_a_place(
    kept: NDArray[np.intp], away: NDArray[np.float64], place: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return of those kept the one in each place that is least away, in their order."""
    by_place = kept[np.lexsort((away, place[kept]))]
    _, first = np.unique(place[by_place], return_index=True)
    return np.sort(by_place[first])

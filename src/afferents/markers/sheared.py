"""A layout that shear has drawn out of shape: markers are looked for where their neighbours went.

One turn, shift and scale places a layout whose skin is at rest. Skin that a drum has held back is
stretched here and squeezed there, by as much as the distance between markers where these are close.
It is so alike from one marker to the next, though, that each is found by what those around it did.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.markers.detect import Positions
from afferents.markers.link import NO_BLOB, link_one_to_one

_NEIGHBOURS = 13
"""A marker is expected where the mean of this many, itself among them, went."""
_ROUNDS = 10
_ADJOINING = 6
"""The layout is also tried on the places of this many neighbours of its middle marker."""


def follow_shear(placed: Positions, blobs: Positions, gate_px: float) -> Positions:
    """Move a layout's places to where the skin has carried them.

    A lattice fits nearly as well one step aside, all but its edge, so it is tried there too, as
    long as more blobs get a place by it.

    Parameters
    ----------
    placed
        The layout under its best turn, shift and scale, shape (n, 2), px.
    blobs
        Shape (m, 2), px.
    gate_px
        A blob farther than this from where a marker is expected is not this marker.

    Returns
    -------
    Positions
        Where the markers are expected, shape (n, 2), px.
    """
    around = cKDTree(placed).query(placed, k=min(_NEIGHBOURS, len(placed)))[1]
    middle = int(((placed - placed.mean(axis=0)) ** 2).sum(axis=1).argmin())
    adjoining = cKDTree(placed).query(placed[middle], k=min(1 + _ADJOINING, len(placed)))[1][1:]
    aside = np.zeros(2)
    worth, expected = _follow(placed, blobs, gate_px, around)
    while True:
        tried = [
            (*_follow(placed + aside + step, blobs, gate_px, around), aside + step)
            for step in placed[adjoining] - placed[middle]
        ]
        best = max(tried, key=lambda one: one[0])
        if best[0] <= worth:
            return expected
        worth, expected, aside = best


def _follow(
    placed: Positions, blobs: Positions, gate_px: float, around: NDArray[np.intp]
) -> tuple[tuple[int, float], Positions]:
    """Link blobs and move each place by the mean of what those `around` it moved, by turns.

    Returns
    -------
    How well the layout fits, to compare (blobs with a place, then how near these lie, in the
    median), and where the markers are expected, (n, 2), px.
    """
    expected = placed
    for _ in range(_ROUNDS):
        blob = link_one_to_one(expected, blobs, gate_px)
        linked = (blob != NO_BLOB)[:, None]
        moved = np.where(linked, blobs[blob] - placed, 0.0)
        n_linked = np.maximum(linked[around].sum(axis=1), 1)
        expected = placed + moved[around].sum(axis=1) / n_linked
    blob = link_one_to_one(expected, blobs, gate_px)
    own = blob != NO_BLOB
    off = np.hypot(*(expected[own] - blobs[blob[own]]).T)
    return (int(own.sum()), -float(np.median(off)) if own.any() else -np.inf), expected

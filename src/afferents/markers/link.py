"""Which blob of a frame is which marker, by where each was last."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from afferents.markers.detect import Positions

NO_BLOB = -1
"""Index that stands for no blob."""


def link_nearest(expected: Positions, blobs: Positions, gate_px: float) -> NDArray[np.intp]:
    """Give each marker the blob nearest to where it was: the published rule.

    Several markers may get the same blob (preprocess/afferent_response.py).

    Parameters
    ----------
    expected
        Where the markers were last, shape (n, 2), px.
    blobs
        Blobs of the new frame, shape (m, 2), px.
    gate_px
        A blob farther than this is not taken.

    Returns
    -------
    NDArray
        Index of each marker's blob, shape (n,), `NO_BLOB` for none.
    """
    if len(blobs) == 0:
        return np.full(len(expected), NO_BLOB, dtype=np.intp)
    distance, index = cKDTree(blobs).query(expected)
    return np.where(distance <= gate_px, index, NO_BLOB)


def link_one_to_one(expected: Positions, blobs: Positions, gate_px: float) -> NDArray[np.intp]:
    """Give each marker at most one blob and each blob to at most one marker.

    Of all such links the one with the least sum of squared distances is taken, where a marker
    without a blob costs the gate squared (Crocker & Grier 1996). Parameters and return value
    are those of `link_nearest`.
    """
    index = np.full(len(expected), NO_BLOB, dtype=np.intp)
    if len(blobs) == 0:
        return index
    cost = np.minimum(cdist(expected, blobs, "sqeuclidean"), gate_px**2)
    marker, blob = linear_sum_assignment(cost)
    linked = cost[marker, blob] < gate_px**2
    index[marker[linked]] = blob[linked]
    return index

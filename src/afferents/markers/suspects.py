"""What looks like a marker and is none: spots of light, specks at the rim, dust."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree, distance

from afferents.markers.detect import Positions, find_markers, spacing_px
from afferents.markers.grid import Grid, find_places, smooth
from afferents.markers.sensor import Sensor
from afferents.store.recording import GreyImage

AROUND, AROUND_MOVED = 3.5, 0.7
"""Only where a quarter of the markers within this many spacings moved by this share of one can a
spot be told from a marker: next to the rim, which holds the skin, pins move little."""
STAYED = 0.2
"""A spot is seen again within this share of the spacing of where it was."""
LINK, FAR_OUT, LEAST_SHARE, FEWEST = 1.7, 1.2, 0.6, 8
"""See `beyond_layout`: spacings to the next of a group and from its outline, share of the largest
group, and how many there must be for one."""
FIELD_LINK, FEWEST_IN_FIELD, LEAST_OF_LARGEST = 1.6, 6, 0.2
"""See `count_in_fields`: spacings to the next of a field, how many there must be for one, and what
share of the largest: 6 specks at the rim of a real TacTip stand next to 100 pins."""
ALONE, APART, MOST_ALONE = 1.2, 1.0, 0.03
"""See `beyond_layout`: spacings to the nearest other, and from the outline, of one that is alone;
with more of these than that share, the layout itself is as wide there."""
MOST_FRAMES, FEWEST_FRAMES = 12, 3
"""Frames, of those where the skin moved most, in which spots are looked for."""
MOSTLY = 0.7
"""A spot stays in more than this share of them."""
MOST_FALSE = 0.05
"""With more blobs too many than this share of a layout, it is another sensor or a picture gone
wrong."""
GATE_SHARE = 0.4
"""A marker lies within this share of the spacing of where smooth rows and columns meet."""


@dataclass
class MovedFrames:
    """The frames of a clip in which the skin was farthest from rest, and the markers in them."""

    frames: list[tuple[float, GreyImage, Positions]] = field(default_factory=list)

    def add(self, image: GreyImage, position: Positions, rest: Positions) -> None:
        """Keep a frame if the skin moved farther in it than in one of those kept."""
        away = np.hypot(*(position - rest).T)
        if np.isnan(away).all():
            return
        farthest = float(np.nanquantile(away, 0.75))
        if len(self.frames) == MOST_FRAMES:
            least = min(range(MOST_FRAMES), key=lambda k: self.frames[k][0])
            if farthest <= self.frames[least][0]:
                return
            del self.frames[least]
        self.frames.append((farthest, image.copy(), position.copy()))


def stay_still(moved: MovedFrames, rest: Positions, sensor: Sensor) -> NDArray[np.bool_]:
    """Return which markers stay where they are while all round them move: spots of light.

    A marker that its neighbours leave behind is lost to the tracker, and so is one that a
    reflection hides; the spot alone is still there to be seen at its place.

    Parameters
    ----------
    rest
        The markers at rest, shape (n, 2), px.

    Returns
    -------
    NDArray
        Shape (n,).
    """
    spacing = spacing_px(rest)
    near = distance.cdist(rest, rest) < AROUND * spacing
    np.fill_diagonal(near, False)
    judged, stayed = np.zeros(len(rest), int), np.zeros(len(rest), int)
    for _, image, position in moved.frames:
        away = np.hypot(*(position - rest).T)
        # What a quarter of those around exceeds, NaN left out; 0 where there is nothing.
        sorted_away = np.sort(np.where(near, away, np.nan), axis=1)  # NaN last
        n = (~np.isnan(sorted_away)).sum(axis=1)
        at = (3 * n // 4).clip(0, max(sorted_away.shape[1] - 1, 0))
        around = np.nan_to_num(np.take_along_axis(sorted_away, at[:, None], axis=1)[:, 0])
        blobs, _ = find_markers(image, sensor)
        if len(blobs) == 0:
            continue
        there = cKDTree(blobs).query(rest)[0] < STAYED * spacing
        telling = around > AROUND_MOVED * spacing
        judged += telling
        gone = away > STAYED * spacing
        came = away > AROUND_MOVED * spacing  # another marker, one that moved, may stand there
        if came.any():
            there &= cKDTree(position[came]).query(rest)[0] >= STAYED * spacing
        stayed += telling & there & ~gone
    still: NDArray[np.bool_] = (judged >= FEWEST_FRAMES) & (stayed > MOSTLY * judged)
    return still


def beyond_layout(position: Positions) -> NDArray[np.bool_]:
    """Return which of what was found lies beyond the layout, apart from it: specks at the rim.

    The layout is the largest group in which each has another within `LINK` spacings. What is of
    another group belongs to it if it lies inside its outline or near to it, as behind a reflection.
    So does not what is alone, farther than a spacing from the outline of all that are not.

    Parameters
    ----------
    position
        Shape (n, 2), px.

    Returns
    -------
    NDArray
        Shape (n,); all False where no group holds most.
    """
    none = np.zeros(len(position), dtype=bool)
    if len(position) < FEWEST:
        return none
    spacing = spacing_px(position)
    tree = cKDTree(position)
    group = _groups(tree, LINK * spacing)
    main = group == np.bincount(group).argmax()
    if main.mean() < LEAST_SHARE:
        return none
    beyond: NDArray[np.bool_] = ~main & (_inside_px(position, main) < -FAR_OUT * spacing)
    alone = main & (tree.query(position, 2)[0][:, 1] > ALONE * spacing)
    if 0 < alone.sum() <= max(1, MOST_ALONE * len(position)):
        beyond |= alone & (_inside_px(position, main & ~alone) < -APART * spacing)
    return beyond


def count_in_fields(position: Positions) -> list[int]:
    """Return how many markers each separate field of a picture has, the largest first.

    In a field each has another within `FIELD_LINK` spacings. Groups of fewer than
    `FEWEST_IN_FIELD`, or `LEAST_OF_LARGEST` of the largest, are specks and no field.

    Parameters
    ----------
    position
        Shape (n, 2), px.
    """
    if len(position) < FEWEST_IN_FIELD:
        return []
    sizes = np.bincount(_groups(cKDTree(position), FIELD_LINK * spacing_px(position)))
    least = max(FEWEST_IN_FIELD, LEAST_OF_LARGEST * sizes.max())
    return sorted((int(n) for n in sizes if n >= least), reverse=True)


def _groups(tree: cKDTree, link_px: float) -> NDArray[np.intp]:
    """Return the group of each position, shape (n,): those linked by steps of this many px."""
    links = tree.sparse_distance_matrix(tree, link_px)
    return np.asarray(connected_components(links, directed=False)[1], np.intp)


def _inside_px(position: Positions, layout: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return how far each lies inside the outline of a layout, px; below 0 outside."""
    outline = cv2.convexHull(position[layout].astype(np.float32))
    return np.array([cv2.pointPolygonTest(outline, (x, y), True) for x, y in position])


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
    row, column = find_places(position)
    kept = np.flatnonzero(_select_fullest(row, rows) & _select_fullest(column, columns))
    meet = smooth(position[kept], Grid(row[kept], column[kept], float("nan")))
    off = meet(np.stack([column[kept], row[kept]], axis=1)) - position[kept]
    gate = GATE_SHARE * spacing_px(position)
    kept = kept[np.hypot(*off.T) <= gate]
    if not len(kept):  # no grid at all, which is reported where places are given
        return position
    # What was left out bends the rows and columns no longer, nor is it counted as one of its own.
    meet = smooth(position[kept], Grid(row[kept], column[kept], float("nan")))
    first = np.array([column[kept].min(), row[kept].min()])
    places = (first + np.argwhere(np.ones((columns, rows)))).astype(np.float64)
    away, nearest = cKDTree(position).query(meet(places), distance_upper_bound=gate)
    return np.asarray(position[np.unique(nearest[np.isfinite(away)])])


def _select_fullest(place: NDArray[np.intp], n: int) -> NDArray[np.bool_]:
    """Return which blobs lie in the n neighbouring rows (or columns) that hold most."""
    if place.max() < n:
        return np.ones(len(place), dtype=bool)
    first = int(np.convolve(np.bincount(place), np.ones(n, dtype=int), "valid").argmax())
    inside: NDArray[np.bool_] = (place >= first) & (place < first + n)
    return inside

"""Which marker stands in which row and column of a square layout.

Row is the rank in y (image down), column the rank in x (image right), as everywhere in the
package. The published arrays are the transpose: their first axis is the rank in x.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csgraph, linalg
from scipy.spatial import cKDTree

from afferents.errors import InputError
from afferents.markers.detect import Positions, spacing_px

PUBLISHED_ROLL_DEG = 6.2
"""Published rest positions are turned by -6.2 degrees (spatial/process_static.ipynb, cell 3)."""
REACH = 1.3
"""Lattice neighbours lie within this multiple of the distance to the nearest marker when the
roll is estimated; diagonal ones lie at 1.41."""
CONE_DEG = 35.0
"""A neighbour along an axis lies within this angle of it; diagonal ones lie at 45 degrees."""
LONGEST = 1.6
"""A link longer than this multiple of the median jumps over a missing marker."""
MOST_MISSING = 0.2
"""With more of a layout missing than this, it is another sensor or a picture gone wrong."""
STRAIGHT = 0.15
"""Markers form a grid if they lie within this share of the spacing, root mean square, of smooth
rows and columns."""
_DEGREE, _ENOUGH_TO_BEND = 3, 30
"""Of the polynomial between places and positions: enough for a fish-eye lens; with fewer markers
than that it is straight."""


@dataclass(frozen=True)
class Grid:
    """Places of n markers in a grid, or in the tactile image of another layout.

    Attributes
    ----------
    row, column
        Place of each marker, shape (n,), from 0 at the top and at the left; places of missing
        markers are not taken. Integers in a grid, else floating; see `places.image_places`.
    roll_deg
        Angle from the image's x axis to the grid's rows, degrees, positive from x towards y
        (clockwise as seen); NaN where there is no grid.
    """

    row: NDArray[np.intp] | NDArray[np.float64]
    column: NDArray[np.intp] | NDArray[np.float64]
    roll_deg: float


def assign_grid(
    position: Positions, rows: int, columns: int, where: object = "the markers"
) -> Grid:
    """Find each marker's row and column, whatever the roll of the camera up to 45 degrees.

    The roll is estimated from the directions to nearest neighbours; markers are then linked to
    their neighbours along both axes, and rows and columns follow from these links. So neither
    a fish-eye lens nor a few px of displacement matters: at a pitch of 22 px, 19 x 19 markers
    that a lens draws in by 10% at the corners may each stand 3 px off in x and y. Beyond what
    it can tell it refuses.

    Parameters
    ----------
    position
        Shape (n, 2), px, in any order; up to a fifth of the grid may be missing.
    where
        The recording, for the error.

    Raises
    ------
    InputError
        If the markers do not form `rows` x `columns`.
    """
    expected = f"{rows} x {columns} = {rows * columns} markers in a grid"
    if not (1 - MOST_MISSING) * rows * columns <= len(position) <= rows * columns:
        raise InputError(f"{where}: expected {expected}, found {len(position)} markers")
    row, column = find_places(position)
    size = (int(row.max()) + 1, int(column.max()) + 1)
    n_places = len(np.unique(row * size[1] + column))
    if size != (rows, columns) or n_places < len(position):
        raise InputError(
            f"{where}: expected {expected}, found {size[0]} rows and {size[1]} columns with "
            f"{n_places} places taken; check the picture for lost or false markers"
        )
    return Grid(row, column, _roll_from_places(position, row, column))


def fill_grid(
    position: Positions, grid: Grid, rows: int, columns: int
) -> tuple[Positions, NDArray[np.bool_]]:
    """Return the markers of all places, by row, then column, and which of them are there.

    A missing marker stands where the smooth rows and columns of the others meet.

    Parameters
    ----------
    position
        Shape (n, 2), px, of the markers that have their places in `grid`.
    """
    row, column = np.divmod(np.arange(rows * columns), columns)
    own = grid.row * columns + grid.column
    filled = smooth(position, grid)(np.stack([column, row], axis=1))
    filled[own] = position
    return filled, np.isin(np.arange(rows * columns), own)


def find_grid(position: Positions) -> Grid | None:
    """Return the grid that markers form, whatever its size; None if they form none.

    Parameters
    ----------
    position
        Shape (n, 2), px, in any order; up to a fifth of the grid may be missing.
    """
    if len(position) < 4:
        return None
    row, column = find_places(position)
    rows, columns = int(row.max()) + 1, int(column.max()) + 1
    whole = rows > 1 and columns > 1 and len(position) >= (1 - MOST_MISSING) * rows * columns
    if not whole or len(np.unique(row * columns + column)) < len(position):
        return None
    grid = Grid(row, column, _roll_from_places(position, row, column))
    off = smooth(position, grid)(np.stack([column, row], axis=1)) - position
    straight = np.sqrt((off**2).sum(axis=1).mean()) <= STRAIGHT * spacing_px(position)
    return grid if straight else None


def smooth(position: Positions, grid: Grid) -> Callable[[Positions], Positions]:
    """Return what leads from places (column, row) to positions, smoothly."""
    return _fit_polynomial(np.stack([grid.column, grid.row], axis=1), position)


def _fit_polynomial(source: Positions, target: Positions) -> Callable[[Positions], Positions]:
    """Return the polynomial from points to points that fits best."""
    degree = _DEGREE if len(source) > _ENOUGH_TO_BEND else 1
    middle, size = source.mean(axis=0), np.ptp(source, axis=0).max() or 1

    def terms(points: Positions) -> NDArray[np.float64]:
        x, y = ((points - middle) / size).T
        powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        return np.stack([x**i * y**j for i, j in powers], axis=1)

    factors = np.linalg.lstsq(terms(source), target, rcond=None)[0]
    return lambda points: np.asarray(terms(points) @ factors)


def find_places(position: Positions) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return row and column of each marker, as the links to its neighbours say."""
    distance, index = cKDTree(position).query(position, k=min(5, len(position)))
    near = distance[:, 1:] < REACH * distance[:, 1:2]
    step = (position[index[:, 1:]] - position[:, None])[near]
    # A grid looks the same after 90 degrees, so directions are averaged modulo 90.
    direction = np.arctan2(step[:, 1], step[:, 0])
    roll_deg = float(np.degrees(np.angle(np.exp(4j * direction).sum())) / 4)
    upright = turn(position, -roll_deg)
    along_x, along_y = _pair_neighbours(upright, axis=0), _pair_neighbours(upright, axis=1)
    column, row = _count_steps(along_x, along_y, upright)
    return row, column


def published_grid(position: Positions, rows: int, columns: int) -> Grid:
    """Find each marker's row and column as the published code does.

    Turn by -6.2 degrees about the image's origin, sort by x, cut into columns, sort each by y
    (spatial/process_static.ipynb, cell 3). Nothing is checked: with another roll or a strong
    lens, markers get the places of their neighbours. The published image[k, l] is
    (column k, row l) here.

    Parameters
    ----------
    position
        Shape (rows * columns, 2), px.
    """
    upright = turn(position, -PUBLISHED_ROLL_DEG)
    by_x = np.argsort(upright[:, 0], kind="stable").reshape(columns, rows)
    within = np.argsort(upright[by_x, 1], axis=1, kind="stable")
    order = np.take_along_axis(by_x, within, axis=1)
    row, column = np.empty((2, len(position)), dtype=np.intp)
    row[order] = np.arange(rows)[None, :]
    column[order] = np.arange(columns)[:, None]
    return Grid(row, column, PUBLISHED_ROLL_DEG)


def turn(position: Positions, angle_deg: float) -> Positions:
    """Turn about the origin of the image, from x towards y."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    turned: Positions = position @ np.array([[cos, sin], [-sin, cos]])
    return turned


def _pair_neighbours(upright: Positions, axis: int) -> NDArray[np.intp]:
    """Pair each marker with the next one along an axis, shape (n_pairs, 2).

    A pair counts only if each of the two is the other's nearest in that direction.
    """
    _, index = cKDTree(upright).query(upright, k=min(9, len(upright)))
    step = upright[index[:, 1:]] - upright[:, None]
    forward = _nearest_in_cone(step[..., axis], step[..., 1 - axis], index[:, 1:])
    backward = _nearest_in_cone(-step[..., axis], step[..., 1 - axis], index[:, 1:])
    start = np.flatnonzero(forward >= 0)
    mutual = backward[forward[start]] == start
    length = np.hypot(*(upright[forward[start]] - upright[start]).T)
    if mutual.any():
        mutual &= length <= LONGEST * np.median(length[mutual])
    return np.stack([start[mutual], forward[start[mutual]]], axis=1)


def _nearest_in_cone(
    along: NDArray[np.float64], across: NDArray[np.float64], index: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return each marker's nearest neighbour within the cone, -1 for none, shape (n,)."""
    inside = np.abs(across) < np.tan(np.radians(CONE_DEG)) * along
    nearest = np.where(inside, np.hypot(along, across), np.inf).argmin(axis=1)
    chosen = np.take_along_axis(index, nearest[:, None], axis=1)[:, 0]
    return np.where(inside.any(axis=1), chosen, -1)


def _count_steps(
    along_x: NDArray[np.intp], along_y: NDArray[np.intp], position: Positions
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Turn links between neighbours into columns and rows from 0.

    Least squares over all links, so that one wrong link among many right ones is outvoted. A
    marker that the missing ones cut off gets the place that it has in the others' lattice.
    """
    n, links = len(position), np.concatenate([along_x, along_y])
    pair = np.arange(len(links))
    sign = np.repeat([-1.0, 1.0], len(links))
    shape = (len(links), n)
    steps = coo_array((sign, (np.tile(pair, 2), links.T.ravel())), shape=shape).tocsr()
    _, island = csgraph.connected_components(abs(steps.T @ steps), directed=False)
    main = island == np.bincount(island).argmax()
    if main.mean() < 1 - MOST_MISSING:
        return np.zeros(n, dtype=np.intp), np.zeros(n, dtype=np.intp)
    in_x = (pair < len(along_x)).astype(float)
    place = np.stack(
        [linalg.lsqr(steps, step, atol=1e-10, btol=1e-10)[0] for step in (in_x, 1 - in_x)], axis=1
    )
    if not main.all():
        place[~main] = _fit_polynomial(position[main], place[main])(position[~main])
    return _round_places(place[:, 0]), _round_places(place[:, 1])


def _round_places(place: NDArray[np.float64]) -> NDArray[np.intp]:
    """Round to whole places, the least of which is 0."""
    # The solution is known up to a shift; the shift that brings most places near a whole number.
    shift = np.angle(np.exp(2j * np.pi * place).sum()) / (2 * np.pi)
    whole = np.rint(place - shift).astype(np.intp)
    return np.asarray(whole - whole.min(), dtype=np.intp)


def _roll_from_places(
    position: Positions, row: NDArray[np.intp], column: NDArray[np.intp]
) -> float:
    """Return the angle of the best similarity from places to positions, degrees."""
    place = column - column.mean() + 1j * (row - row.mean())
    centred = position - position.mean(axis=0)
    return float(np.degrees(np.angle(np.vdot(place, centred[:, 0] + 1j * centred[:, 1]))))

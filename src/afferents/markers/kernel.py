"""Windowed centroids of all markers in one pass over the picture, in Numba."""

import numpy as np
from numba import njit

LOW, HIGH = 0.25, 0.75
"""Between these shares of a marker's contrast a pixel counts in part: below lies the noise of the
skin, above that of the disc."""
AGAIN_PX = 0.5
"""A centroid farther than this from its window's middle is taken again round itself."""

CELL = 4
"""Side of the cells in which owners of blobs are entered, px: no two blobs in one."""

_kernel = njit(cache=True, error_model="numpy", nogil=True)
_fast_kernel = njit(cache=True, error_model="numpy", nogil=True, fastmath=True)
"""For what sees no NaN: fast maths would take every number for one."""


@_kernel
def centroids(image, expected, dark, bright, half, mass, again, position, found):
    """Find each marker near where it is expected.

    Parameters
    ----------
    image
        Shape (height, width), uint8.
    expected
        Shape (n, 2), px; markers that are NaN are not looked for.
    dark, bright
        Grey level of the skin and of each marker, shape (n,).
    half
        Half the side of each marker's window, px, shape (n,).
    mass
        Weight of each whole marker, px, shape (n,); one with less than half of it or more than
        one and a half is none.
    again
        Windows at most for a marker.
    position, found
        Filled with the centroids, NaN where none was found, (n, 2) and (n,).
    """
    for i in range(len(expected)):
        x, y = expected[i, 0], expected[i, 1]
        weight = np.float32(0)
        for _ in range(again):
            if np.isnan(x):
                break
            weight, mx, my = _moment(image, x, y, dark[i], bright[i], half[i])
            if weight <= 0:
                break
            moved = max(abs(mx - x), abs(my - y))
            x, y = mx, my
            if moved < AGAIN_PX:
                break
        found[i] = 0.5 * mass[i] < weight < 1.5 * mass[i]
        position[i, 0] = x if found[i] else np.nan
        position[i, 1] = y if found[i] else np.nan


@_fast_kernel
def _moment(image, x, y, dark, bright, half):
    """Return weight and centroid of the window round (x, y)."""
    height, width = image.shape
    left, top = int(np.rint(x)) - half, int(np.rint(y)) - half
    first, last = max(left, 0), min(left + 2 * half + 1, width)
    low = np.float32(dark + LOW * (bright - dark))
    per = np.float32(1 / ((HIGH - LOW) * (bright - dark)))
    weight, wx, wy = np.float32(0), np.float32(0), np.float32(0)
    zero, one = np.float32(0), np.float32(1)
    for row in range(max(top, 0), min(top + 2 * half + 1, height)):
        of_row, x_of_row = zero, zero
        line = image[row, first:last]
        for j in range(len(line)):
            w = min(max((np.float32(line[j]) - low) * per, zero), one)
            of_row += w
            x_of_row += w * np.float32(j)
        weight += of_row
        wx += x_of_row
        wy += of_row * np.float32(row - top)
    if weight <= 0:
        return zero, x, y
    return weight, first + wx / weight, top + wy / weight


@_kernel
def brightness(image, position, dx, dy):
    """Return the mean grey level at the markers' middles (3 x 3 px), moved by (dx, dy)."""
    height, width = image.shape
    total, n = 0.0, 0
    for i in range(len(position)):
        if np.isnan(position[i, 0]):
            continue
        n += 1
        column, row = int(np.rint(position[i, 0] + dx)), int(np.rint(position[i, 1] + dy))
        if 1 <= column < width - 1 and 1 <= row < height - 1:
            for r in range(row - 1, row + 2):
                total += float(image[r, column - 1]) + image[r, column] + image[r, column + 1]
    return total / (9 * max(n, 1))


@_kernel
def best_shift(image, position, reach, step, sign):
    """Return the common shift (dx, dy) under which the markers' middles are brightest.

    Tried are all multiples of `step` px up to `reach` px; near ones are preferred, since a
    lattice nearly fits itself when it is shifted by its pitch.
    """
    best, best_x, best_y = -np.inf, 0.0, 0.0
    n = int(reach / step)
    for j in range(-n, n + 1):
        for i in range(-n, n + 1):
            dx, dy = i * step, j * step
            if dx * dx + dy * dy > reach * reach:
                continue
            score = sign * brightness(image, position, dx, dy)
            if score > best:
                best, best_x, best_y = score, dx, dy
    return best_x, best_y


@_kernel
def levels(image, position, half, dark, bright):
    """Fill in the grey level of each marker's middle and of the skin at its window's corners."""
    height, width = image.shape
    for i in range(len(position)):
        column, row = int(np.rint(position[i, 0])), int(np.rint(position[i, 1]))
        top, bottom = max(row - half[i], 0), min(row + half[i], height - 1)
        left, right = max(column - half[i], 0), min(column + half[i], width - 1)
        corners = float(image[top, left]) + image[top, right]
        dark[i] = (corners + image[bottom, left] + image[bottom, right]) / 4
        middle = 0.0
        for r in range(max(row - 1, 0), min(row + 2, height)):
            for c in range(max(column - 1, 0), min(column + 2, width)):
                middle += image[r, c]
        bright[i] = middle / 9


@_kernel
def carried(displacement, neighbours, i):
    """Return the mean displacement of a marker's neighbours that were found, and their number."""
    dx, dy, n = 0.0, 0.0, 0
    for j in neighbours[i]:
        if not np.isnan(displacement[j, 0]):
            dx += displacement[j, 0]
            dy += displacement[j, 1]
            n += 1
    return dx / max(n, 1), dy / max(n, 1), n


@_kernel
def drop_strangers(position, found, rest, neighbours, farthest):
    """Unfind markers that do not move with their neighbours; return how many there were.

    Parameters
    ----------
    neighbours
        Shape (n, k).
    farthest
        How far a marker's displacement may lie from its neighbours' mean, px, shape (n,). Less
        than half the distance to the nearest marker, so that no two can hold one blob.
    """
    displacement = position - rest
    n_strangers = 0
    for i in range(len(position)):
        if found[i]:
            dx, dy, n = carried(displacement, neighbours, i)
            off_x, off_y = displacement[i, 0] - dx, displacement[i, 1] - dy
            if n and off_x * off_x + off_y * off_y > farthest[i] ** 2:
                found[i] = False
                n_strangers += 1
    for i in range(len(position)):
        if not found[i]:
            position[i] = np.nan
    return n_strangers


@_kernel
def share_blobs(position, found, predicted, nearest, owner):
    """Where two markers hold one blob, leave it to the one that was expected nearer to it.

    Parameters
    ----------
    nearest
        Two markers nearer to each other than this are on one blob, px, shape (n,).
    owner
        Room for the picture in cells of CELL px, shape (height / CELL + 1, width / CELL + 1).

    Returns
    -------
    How many markers lost their blob.
    """
    owner[:] = -1
    rows, columns = owner.shape
    n_lost = 0
    for i in range(len(position)):
        if not found[i]:
            continue
        row, column = int(position[i, 1] / CELL), int(position[i, 0] / CELL)
        reach = int(nearest[i] / CELL) + 1
        for r in range(max(row - reach, 0), min(row + reach + 1, rows)):
            for c in range(max(column - reach, 0), min(column + reach + 1, columns)):
                j = owner[r, c]
                if j >= 0 and found[i] and found[j]:
                    near = min(nearest[i], nearest[j]) ** 2
                    if _distance2(position[i], position[j]) < near:
                        off_i = _distance2(position[i], predicted[i])
                        off_j = _distance2(position[j], predicted[j])
                        loser = i if off_i > off_j else j
                        found[loser] = False
                        position[loser] = np.nan
                        n_lost += 1
        if found[i]:
            owner[min(row, rows - 1), min(column, columns - 1)] = i
    return n_lost


@_kernel
def _distance2(a, b):
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


@_kernel
def from_neighbours(position, rest, last, neighbours, expected):
    """Fill in where each marker is: where found, or else where its neighbours' motion puts it."""
    displacement = position - rest
    for i in range(len(position)):
        if not np.isnan(position[i, 0]):
            expected[i] = position[i]
            continue
        dx, dy, n = carried(displacement, neighbours, i)
        if n:
            expected[i, 0], expected[i, 1] = rest[i, 0] + dx, rest[i, 1] + dy
        else:
            expected[i] = last[i]


@_kernel
def weigh(image, position, dark, bright, half, mass, refined):
    """Fill in each marker's weight and its centroid, taken twice, in the rest frame."""
    for i in range(len(position)):
        x, y = position[i, 0], position[i, 1]
        for _ in range(2):
            mass[i], x, y = _moment(image, x, y, dark[i], bright[i], half[i])
        refined[i, 0], refined[i, 1] = x, y

"""Windowed centroids of all markers in one pass over the picture, in Numba."""

import numpy as np
from numpy.typing import NDArray

from afferents.compiled import compiled

LOW, HIGH = 0.15, 0.85
"""Between these shares of a marker's contrast a pixel counts in part: below lies the noise of the
skin, above that of the disc."""
AGAIN_PX = 0.5
"""A centroid farther than this from its window's middle is taken again round itself,"""
WINDOWS = 3
"""at most so often for a marker."""
SEARCH_STEP_PX = 2.5
"""A common shift is searched in such steps."""
FOLLOW_LIGHT = 0.1
"""Share of a new grey level in the running mean."""

_SHORT_HALF = 12
"""Half the side of the largest window whose sums fit into 16 bits: 25 rows."""
_LANES = 16
"""Columns that the processor works on at once."""

_kernel = compiled(error_model="numpy", nogil=True)
_fast_kernel = compiled(error_model="numpy", nogil=True, fastmath=True)
"""For what sees no NaN: fast maths would take every number for one."""


@_kernel
def centroids(image, expected, dark, bright, half, mass, room, position, found):
    """Find each marker near where it is expected; return how many were found.

    Parameters
    ----------
    image
        Shape (height, width), uint8, contiguous.
    expected
        Shape (n, 2), px; markers that are NaN are not looked for.
    dark, bright
        Grey level of the skin and of each marker, shape (n,).
    half
        Half the side of each marker's window, px, shape (n,).
    mass
        Weight of each whole marker, px, shape (n,); one with less than half of it or more than
        one and a half is none.
    room
        To work in, see `working_room`.
    position, found
        Filled with the centroids, NaN where none was found, (n, 2) and (n,).
    """
    (height, width), pixels = image.shape, image.ravel()
    columns, lower = room[0], room[1]
    n_found = 0
    for i in range(len(expected)):
        x, y = expected[i, 0], expected[i, 1]
        weight = 0.0
        for _ in range(WINDOWS):
            if np.isnan(x):
                break
            weight, mx, my = _moment(
                pixels, height, width, x, y, dark[i], bright[i], half[i], columns, lower
            )
            if weight <= 0:
                break
            moved = max(abs(mx - x), abs(my - y))
            x, y = mx, my
            if moved < AGAIN_PX:
                break
        found[i] = 0.5 * mass[i] < weight < 1.5 * mass[i]
        position[i, 0] = x if found[i] else np.nan
        position[i, 1] = y if found[i] else np.nan
        n_found += found[i]
    return n_found


def working_room(half: NDArray[np.int64]) -> NDArray[np.generic]:
    """Return the room that `centroids` works in: two sums for each column of a window.

    Sums of 16 bits are the faster ones; large windows need more.
    """
    largest = int(half.max(initial=0))
    columns = 2 * largest + 1 + _LANES
    return np.zeros((2, columns), np.uint16 if largest <= _SHORT_HALF else np.uint32)


@_fast_kernel
def _moment(pixels, height, width, x, y, dark, bright, half, columns, lower):
    """Return weight and centroid of the window round (x, y).

    Four rows at a time are added to the sums of their columns, and these to sums of their own,
    which gives the moment in y without a product: sum_r (n - r) w_r. Columns up to the next
    multiple of 16 are read too, which costs less than to leave them out, and dropped at the end.
    """
    if not (0 <= x < width and 0 <= y < height):
        return 0.0, x, y
    left, top = int(np.rint(x)) - half, int(np.rint(y)) - half
    first, above = max(left, 0), max(top, 0)
    n = min(left + 2 * half + 1, width) - first
    rows = min(top + 2 * half + 1, height) - above
    # A pixel weighs 0 to `most` grey levels; where discs are darker than the skin, in its negative.
    negative = np.uint8(255 if bright < dark else 0)
    low = dark + LOW * (bright - dark)
    low = np.int16(np.rint(255 - low if bright < dark else low))
    most = np.int16(np.rint((HIGH - LOW) * abs(bright - dark)))
    if most <= 0:
        return 0.0, x, y
    wide = min((n + _LANES - 1) // _LANES * _LANES, width - first)
    fours = rows // 4
    for j in range(wide):
        columns[j] = 0
        lower[j] = 0
    as_sum = columns.dtype.type
    at = np.uint64(above * width + first)
    one, two = np.uint64(width), np.uint64(2 * width)
    three, four = np.uint64(3 * width), np.uint64(4 * width)
    for _ in range(fours):
        for j in range(wide):
            k = at + np.uint64(j)
            c, s = columns[j], lower[j]
            c = as_sum(c + _weight(pixels[k], negative, low, most))
            s = as_sum(s + c)
            c = as_sum(c + _weight(pixels[k + one], negative, low, most))
            s = as_sum(s + c)
            c = as_sum(c + _weight(pixels[k + two], negative, low, most))
            s = as_sum(s + c)
            c = as_sum(c + _weight(pixels[k + three], negative, low, most))
            s = as_sum(s + c)
            columns[j], lower[j] = c, s
        at += four
    for _ in range(4 * fours, rows):
        for j in range(wide):
            c = as_sum(columns[j] + _weight(pixels[at + np.uint64(j)], negative, low, most))
            columns[j], lower[j] = c, as_sum(lower[j] + c)
        at += one
    weight, wx, wy = 0, 0, 0
    for j in range(n):
        weight += columns[j]
        wx += columns[j] * j
        wy += lower[j]
    if weight <= 0:
        return 0.0, x, y
    return weight / most, first + wx / weight, above + rows - wy / weight


@_fast_kernel
def _weight(grey, negative, low, most):
    return np.uint16(min(max(np.int16(np.int16(grey ^ negative) - low), np.int16(0)), most))


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
def best_shift(image, position, reach, sign):
    """Return the common shift (dx, dy) under which the markers' middles are brightest.

    Tried are all multiples of `SEARCH_STEP_PX` up to `reach` px. A lattice nearly fits itself when
    it is shifted by its pitch; the markers at its edge, which then miss, decide.
    """
    best, best_x, best_y = -np.inf, 0.0, 0.0
    n = int(reach / SEARCH_STEP_PX)
    for j in range(-n, n + 1):
        for i in range(-n, n + 1):
            dx, dy = i * SEARCH_STEP_PX, j * SEARCH_STEP_PX
            if dx * dx + dy * dy > reach * reach:
                continue
            score = sign * brightness(image, position, dx, dy)
            if score > best:
                best, best_x, best_y = score, dx, dy
    return best_x, best_y


@_kernel
def levels(image, position, half, dark, bright):
    """Fill in the grey level of each marker's middle and of the skin at its window's corners."""
    for i in range(len(position)):
        dark[i], bright[i] = _levels(image, position[i, 0], position[i, 1], half[i])


@_kernel
def _levels(image, x, y, half):
    height, width = image.shape
    column, row = int(np.rint(x)), int(np.rint(y))
    column, row = min(max(column, 1), width - 2), min(max(row, 1), height - 2)
    top, bottom = max(row - half, 0), min(row + half, height - 1)
    left, right = max(column - half, 0), min(column + half, width - 1)
    corners = float(image[top, left]) + image[top, right]
    middle = 0.0
    for r in range(row - 1, row + 2):
        middle += float(image[r, column - 1]) + image[r, column] + image[r, column + 1]
    return (corners + image[bottom, left] + image[bottom, right]) / 4, middle / 9


@_kernel
def carried(position, rest, neighbours, i):
    """Return the mean displacement of a marker's neighbours that were found, and their number."""
    dx, dy, n = 0.0, 0.0, 0
    for k in range(neighbours.shape[1]):
        j = neighbours[i, k]
        if not np.isnan(position[j, 0]):
            dx += position[j, 0] - rest[j, 0]
            dy += position[j, 1] - rest[j, 1]
            n += 1
    return dx / max(n, 1), dy / max(n, 1), n


@_kernel
def drop_strangers(position, found, rest, neighbours, farthest, strange):
    """Unfind markers that do not move with their neighbours; return how many there were.

    Parameters
    ----------
    neighbours
        Shape (n, k).
    farthest
        How far a marker's displacement may lie from its neighbours' mean, px, shape (n,). Less
        than half the distance to the nearest marker, so that no two can hold one blob.
    strange
        To work in, shape (n,).
    """
    n_strangers = 0
    for i in range(len(position)):
        strange[i] = False
        if found[i]:
            dx, dy, n = carried(position, rest, neighbours, i)
            off_x, off_y = position[i, 0] - rest[i, 0] - dx, position[i, 1] - rest[i, 1] - dy
            if n and off_x * off_x + off_y * off_y > farthest[i] ** 2:
                strange[i] = True
                n_strangers += 1
    for i in range(len(position)):
        if strange[i]:
            found[i] = False
            position[i, 0] = position[i, 1] = np.nan
    return n_strangers


@_kernel
def any_torn(position, rest, neighbours, limit):
    """Return whether any two neighbours moved apart, or together, by more than allowed.

    Parameters
    ----------
    neighbours
        Shape (n, k).
    limit
        How far their ways from rest may differ, squared, px^2, shape (n, k).
    """
    for i in range(len(position)):
        dx, dy = position[i, 0] - rest[i, 0], position[i, 1] - rest[i, 1]
        for k in range(neighbours.shape[1]):
            j = neighbours[i, k]
            off_x, off_y = position[j, 0] - rest[j, 0] - dx, position[j, 1] - rest[j, 1] - dy
            if off_x * off_x + off_y * off_y > limit[i, k]:  # never of a lost one: NaN
                return True
    return False


@_kernel
def share_blobs(position, found, predicted, neighbours, nearest):
    """Where two markers hold one blob, leave it to the one that was expected nearer to it.

    Parameters
    ----------
    neighbours
        Shape (n, k); windows of others never meet.
    nearest
        Two markers nearer to each other than this are on one blob, px, shape (n,).

    Returns
    -------
    How many markers lost their blob.
    """
    n_lost = 0
    for i in range(len(position)):
        for k in range(neighbours.shape[1]):
            j = neighbours[i, k]
            apart = _distance2(position, i, position, j)
            if apart < min(nearest[i], nearest[j]) ** 2:  # never of a lost one: NaN
                off_i = _distance2(position, i, predicted, i)
                off_j = _distance2(position, j, predicted, j)
                loser = i if off_i > off_j else j
                found[loser] = False
                position[loser, 0] = position[loser, 1] = np.nan
                n_lost += 1
    return n_lost


@_kernel
def _distance2(a, i, b, j):
    return (a[i, 0] - b[j, 0]) ** 2 + (a[i, 1] - b[j, 1]) ** 2


@_kernel
def from_neighbours(position, rest, last, neighbours, expected):
    """Fill in where each marker is: where found, or else where its neighbours' motion puts it."""
    for i in range(len(position)):
        if not np.isnan(position[i, 0]):
            expected[i, 0], expected[i, 1] = position[i, 0], position[i, 1]
            continue
        dx, dy, n = carried(position, rest, neighbours, i)
        if n:
            expected[i, 0], expected[i, 1] = rest[i, 0] + dx, rest[i, 1] + dy
        else:
            expected[i, 0], expected[i, 1] = last[i, 0], last[i, 1]


@_kernel
def look(
    image, expected, step, rest, dark, bright, half, mass, neighbours, nearest, farthest, light,
    room, strange, predicted, position, found,
):  # fmt: skip
    """Find all markers in a frame, where they are not far from where they are expected.

    Grey levels follow the picture's brightness first. Markers are looked for one step on, or
    else where they were.

    Parameters
    ----------
    light
        The picture's brightness in the last frame: the mean of every 16th pixel of every 16th row.
    predicted, position, found
        Filled in, as for `centroids`.

    Returns
    -------
    The picture's brightness, how many markers were found (-1 where the discs are at neither
    place, and nothing was looked for), how many were lost as shared and as strangers, and how
    far all moved together, px.
    """
    height, width = image.shape
    total, n = 0, 0
    for row in range(0, height, 16):
        for column in range(0, width, 16):
            total += image[row, column]
            n += 1
    now = total / n
    if now > 0 and light > 0:
        dark *= now / light
        bright *= now / light
    middle = (dark.mean() + bright.mean()) / 2
    bright_discs = bright.mean() >= dark.mean()
    for guess in range(2):
        for i in range(len(expected)):
            predicted[i, 0] = expected[i, 0] + (step[i, 0] if guess == 0 else 0.0)
            predicted[i, 1] = expected[i, 1] + (step[i, 1] if guess == 0 else 0.0)
        there = brightness(image, predicted, 0.0, 0.0)
        if (there > middle) == bright_discs:
            centroids(image, predicted, dark, bright, half, mass, room, position, found)
            shared, strangers = 0, 0
            if not moved_as_one(position, rest, farthest.min() / 2):
                shared = share_blobs(position, found, predicted, neighbours, nearest)
                strangers = drop_strangers(position, found, rest, neighbours, farthest, strange)
            return now, found.sum(), shared, strangers, common_step(position, expected)
    return now, -1, 0, 0, 0.0


@_kernel
def moved_as_one(position, rest, within):
    """Return whether every marker that was found moved with all others, within so many px.

    Where that is half of what `drop_strangers` allows, none can be a stranger, nor can two be on
    one blob, which are the two costlier checks.
    """
    dx, dy, n = _summed_step(position, rest)
    dx, dy = dx / max(n, 1), dy / max(n, 1)
    farthest2 = 0.0
    for i in range(len(position)):
        off_x, off_y = position[i, 0] - rest[i, 0] - dx, position[i, 1] - rest[i, 1] - dy
        off2 = off_x * off_x + off_y * off_y
        if off2 > farthest2:  # never of a lost one: NaN
            farthest2 = off2
    return farthest2 < within * within


@_kernel
def common_step(position, last):
    """Return how far all markers that were found moved together, px."""
    dx, dy, n = _summed_step(position, last)
    return np.hypot(dx, dy) / n if n > 1 else 0.0


@_kernel
def _summed_step(position, since):
    """Return the sum of the steps of all markers that were found, and their number."""
    dx, dy, n = 0.0, 0.0, 0
    for i in range(len(position)):
        if not np.isnan(position[i, 0]):
            dx += position[i, 0] - since[i, 0]
            dy += position[i, 1] - since[i, 1]
            n += 1
    return dx, dy, n


@_kernel
def remember(image, position, rest, neighbours, half, expected, step, dark, bright):
    """Keep places, steps and grey levels for the next frame, in place."""
    for i in range(len(position)):
        seen = not np.isnan(position[i, 0])
        for axis in range(2):
            step[i, axis] = position[i, axis] - expected[i, axis] if seen else 0.0
        if seen:
            skin, disc = _levels(image, position[i, 0], position[i, 1], half[i])
            dark[i] += FOLLOW_LIGHT * (skin - dark[i])
            bright[i] += FOLLOW_LIGHT * (disc - bright[i])
    from_neighbours(position, rest, expected, neighbours, expected)


@_kernel
def weigh(image, position, dark, bright, half, mass, room, refined):
    """Fill in each marker's weight and its centroid, taken twice, in the rest frame."""
    (height, width), pixels = image.shape, image.ravel()
    columns, lower = room[0], room[1]
    for i in range(len(position)):
        x, y = position[i, 0], position[i, 1]
        for _ in range(2):
            mass[i], x, y = _moment(
                pixels, height, width, x, y, dark[i], bright[i], half[i], columns, lower
            )
        refined[i, 0], refined[i, 1] = x, y

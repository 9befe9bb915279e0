"""What the convolutions on a CPU do besides multiplying matrices, in Numba.

Arrays hold planes: what belongs to one place of an image, of all images and channels of a batch,
lies side by side in memory, thousands of numbers that the processor goes through at once. They are
passed as they lie in memory, in one dimension, with their shape beside them: views of parts would
cost more than the work on a part.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

_CHUNK = 512
"""Numbers of a plane that are worked on at a time, so that a pass stays in the nearest cache."""

_kernel = njit(cache=True, error_model="numpy", nogil=True)
_fast_kernel = njit(cache=True, error_model="numpy", nogil=True, fastmath={"contract", "nsz"})
"""May fuse products and sums."""


@_fast_kernel
def _add(target, t, factor, source, s, n):
    """Add n numbers of `source` from s, times a factor, to those of `target` from t.

    Unsigned, because an index that might be negative would be checked at every number.
    """
    t, s = np.uintp(t), np.uintp(s)
    for i in range(np.uintp(n)):
        target[t + i] += factor * source[s + i]


@_kernel
def _sum(target, t, factors, f, n_factors, source, s, apart, n):
    """Fill n numbers of `target` with the sum of stretches of `source`, each times its factor."""
    target[t : t + n] = 0
    for k in range(n_factors):
        if factors[f + k] != 0:
            _add(target, t, factors[f + k], source, s + k * apart, n)


@_kernel
def _inside(first, size, length):
    """Return which part of `size` places from `first` lies within the length: from, to."""
    return max(0, -first), max(0, min(size, length - first))


@_kernel
def to_tiles(planes, shape, of_rows, of_columns, step, edge, tiles, n_tiles):
    """Combine the planes of every tile, as many rows and columns as the matrices have columns.

    Parameters
    ----------
    planes, shape
        (height, width, numbers).
    of_rows, of_columns
        Shapes (p, a) and (q, b): tiles have a x b places, p x q combinations are made of each.
    step, edge
        From one tile to the next, and how far the first lies outside, in rows and columns; what
        lies outside is 0.
    tiles, n_tiles
        Filled, (p, q, tiles down, tiles across, numbers); the two in the middle.
    """
    height, width, n_numbers = shape
    (p, a), (q, b), (down, aside) = of_rows.shape, of_columns.shape, n_tiles
    rows, columns = of_rows.ravel(), of_columns.ravel()
    across = np.empty(width * _CHUNK, np.float32)
    for start in range(0, n_numbers, _CHUNK):
        n = min(_CHUNK, n_numbers - start)
        for i in range(down):
            top = i * step[0] - edge[0]
            low, high = _inside(top, a, height)
            for u in range(p):
                for x in range(width):
                    source = ((top + low) * width + x) * n_numbers + start
                    _sum(across, x * _CHUNK, rows, u * a + low, high - low, planes, source,
                             width * n_numbers, n)  # fmt: skip
                for j in range(aside):
                    left = j * step[1] - edge[1]
                    first, last = _inside(left, b, width)
                    for v in range(q):
                        target = (((u * q + v) * down + i) * aside + j) * n_numbers + start
                        _sum(tiles, target, columns, v * b + first, last - first, across,
                                 (left + first) * _CHUNK, _CHUNK, n)  # fmt: skip


@_kernel
def from_tiles(tiles, n_tiles, of_rows, of_columns, step, edge, planes, shape):
    """Fill `planes` with what the transpose of `to_tiles` makes of `tiles`; overlaps add up."""
    height, width, n_numbers = shape
    (p, a), (q, b), (down, aside) = of_rows.shape, of_columns.shape, n_tiles
    across = np.empty(width * _CHUNK, np.float32)
    summed = np.empty(height * width * _CHUNK, np.float32)
    for start in range(0, n_numbers, _CHUNK):
        n = min(_CHUNK, n_numbers - start)
        summed[:] = 0
        for i in range(down):
            top = i * step[0] - edge[0]
            low, high = _inside(top, a, height)
            for u in range(p):
                across[:] = 0
                for j in range(aside):
                    left = j * step[1] - edge[1]
                    first, last = _inside(left, b, width)
                    source = ((u * q * down + i) * aside + j) * n_numbers + start
                    for k in range(first, last):
                        for v in range(q):
                            if of_columns[v, k] != 0:
                                _add(across, (left + k) * _CHUNK, of_columns[v, k], tiles,
                                     source + v * down * aside * n_numbers, n)  # fmt: skip
                for k in range(low, high):
                    if of_rows[u, k] != 0:
                        _add(summed, (top + k) * width * _CHUNK, of_rows[u, k], across, 0,
                             width * _CHUNK)  # fmt: skip
        for place in range(height * width):
            target, source = place * n_numbers + start, place * _CHUNK
            planes[target : target + n] = summed[source : source + n]


@lru_cache
def first_layer(kernel_shape: tuple[int, int], pool: tuple[int, int]) -> Any:
    """Return `first_maps` and `first_maps_gradient` for kernels and pools of a size.

    The compiler knows the size then, and keeps everything but the channels in registers.
    """
    n_values, n_places = kernel_shape[0] * kernel_shape[1], pool[0] * pool[1]

    @_fast_kernel
    def first_maps(images, kernels, bias, maps, which):
        """Convolve single-channel images, same size, then pool and ReLU, in one go.

        Parameters
        ----------
        images
            Shape (n, height, width).
        kernels, bias
            Shapes (values of the kernel, channels) and (channels,).
        maps
            Filled, shape (pooled height * pooled width * n, channels).
        which
            Filled, of the same shape, uint8: the place in the pool whose response was the largest;
            one more than there are where that is not above 0.
        """
        n_images, height, width = images.shape
        framed = _frame(height, width, kernel_shape)
        patches = np.empty((n_places, n_values), np.float32)
        down, aside = height // pool[0], width // pool[1]
        for n in range(n_images):
            _fill(framed, images[n], kernel_shape)
            for i in range(down):
                for j in range(aside):
                    _cut(framed, i, j, pool, kernel_shape, patches)
                    row = (i * aside + j) * n_images + n
                    for c in range(len(bias)):
                        largest, best = np.float32(-np.inf), np.uint8(0)
                        for place in range(n_places):
                            response = np.float32(0)
                            for k in range(n_values):
                                response += patches[place, k] * kernels[k, c]
                            best = np.uint8(place) if response > largest else best
                            largest = response if response > largest else largest
                        largest += bias[c]
                        which[row, c] = best if largest > 0 else np.uint8(n_places)
                        maps[row, c] = largest if largest > 0 else np.float32(0)

    @_fast_kernel
    def first_maps_gradient(images, change, which, of_kernels):
        """Add to `of_kernels`, 0 before, the gradient of `first_maps` where maps have `change`.

        The last row, below those of the kernel's values, is the gradient of the bias.
        """
        n_images, height, width = images.shape
        framed = _frame(height, width, kernel_shape)
        patches = np.empty((n_places, n_values), np.float32)
        n_channels, zero = of_kernels.shape[1], np.float32(0)
        of_places = np.empty((n_places, n_channels), np.float32)
        down, aside = height // pool[0], width // pool[1]
        for n in range(n_images):
            _fill(framed, images[n], kernel_shape)
            for i in range(down):
                for j in range(aside):
                    _cut(framed, i, j, pool, kernel_shape, patches)
                    row = (i * aside + j) * n_images + n
                    for place in range(n_places):
                        for c in range(n_channels):
                            size = change[row, c]
                            of_places[place, c] = size if which[row, c] == place else zero
                    for k in range(n_values):
                        for c in range(n_channels):
                            size = zero
                            for place in range(n_places):
                                size += patches[place, k] * of_places[place, c]
                            of_kernels[k, c] += size
                    for place in range(n_places):
                        for c in range(n_channels):
                            of_kernels[n_values, c] += of_places[place, c]

    return first_maps, first_maps_gradient


@_kernel
def _frame(height, width, kernel_shape):
    """Return room for an image with a frame of 0 round it."""
    return np.zeros((height + kernel_shape[0] - 1, width + kernel_shape[1] - 1), np.float32)


@_kernel
def _fill(framed, image, kernel_shape):
    """Put an image into the frame."""
    top, left = kernel_shape[0] // 2, kernel_shape[1] // 2
    framed[top : top + image.shape[0], left : left + image.shape[1]] = image


@_kernel
def _cut(framed, i, j, pool, kernel_shape, patches):
    """Fill `patches` with what the kernels see from each place of a pool."""
    for down in range(pool[0]):
        for aside in range(pool[1]):
            for y in range(kernel_shape[0]):
                for x in range(kernel_shape[1]):
                    value = framed[i * pool[0] + down + y, j * pool[1] + aside + x]
                    patches[down * pool[1] + aside, y * kernel_shape[1] + x] = value


@_fast_kernel
def _where(target, t, source, which, s, place, n):
    """Take n numbers of `source` from s over where `which` is the place, else 0."""
    t, s = np.uintp(t), np.uintp(s)
    for i in range(np.uintp(n)):
        target[t + i] = source[s + i] if which[s + i] == place else np.float32(0)


@_fast_kernel
def pool_planes(planes, shape, pool, pooled, which):
    """Fill `pooled` with the largest of each pool and `which` with its place; see `first_maps`."""
    height, width, n_numbers = shape
    aside = width // pool[1]
    for i in range(height // pool[0]):
        for j in range(aside):
            corner = (i * pool[0] * width + j * pool[1]) * n_numbers
            t = np.uintp((i * aside + j) * n_numbers)
            s = np.uintp(corner)
            for c in range(np.uintp(n_numbers)):
                pooled[t + c] = planes[s + c]
                which[t + c] = 0
            for place in range(1, pool[0] * pool[1]):
                apart = (place // pool[1] * width + place % pool[1]) * n_numbers
                s = np.uintp(corner + apart)
                for c in range(np.uintp(n_numbers)):
                    value, largest = planes[s + c], pooled[t + c]
                    which[t + c] = np.uint8(place) if value > largest else which[t + c]
                    pooled[t + c] = value if value > largest else largest


@_kernel
def unpool_planes(change, which, pool, planes, shape):
    """Fill `planes`, 0 before, with the gradient of `pool_planes` where `pooled` has `change`."""
    height, width, n_numbers = shape
    aside = width // pool[1]
    for i in range(height // pool[0]):
        for j in range(aside):
            for place in range(pool[0] * pool[1]):
                y, x = i * pool[0] + place // pool[1], j * pool[1] + place % pool[1]
                target, source = (y * width + x) * n_numbers, (i * aside + j) * n_numbers
                _where(planes, target, change, which, source, place, n_numbers)

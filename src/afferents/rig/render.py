"""Pictures of the pins: white discs on dark skin, as the camera's sensor sees them.

A picture is summed in whole 1/32 grey levels: the lit skin with the sensor's noise, then every disc
in a window of its own.
"""

import math
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import erf

from afferents.core.recording import GreyImage
from afferents.rig.camera import Camera, Points

_PER_GREY = 32
"""Pictures are summed in this many parts of a grey level, which fit 16 bits with room to spare."""
_LOUDEST_GREY = 500.0
"""Noise beyond this is cut off, for the same reason; the picture has 256 grey levels."""
_PLACES = 1 << 18
"""Noise is drawn once and read from one of so many places for each frame."""
_REACH_PX = 3.0
"""The edge of a disc is blurred no farther than this."""
_EDGE_STEPS = 64
"""Values a px in the table of a disc's edge."""
_STEPS = 64
"""A disc is drawn once for each of so many places within a pixel, along x and along y."""
_FULL = 255
"""A stamp's value where the disc covers the whole pixel."""
_LANES = 8
"""Stamps are a multiple of this wide, which suits processors."""


class Renderer:
    """Draws frames of a number of discs.

    Parameters
    ----------
    camera
        Optics and lights.
    seed
        Of the noise.
    """

    def __init__(self, camera: Camera, seed: int) -> None:
        """Draw the noise and light the empty skin."""
        self.camera = camera
        self._rng = np.random.default_rng(seed)
        light = _light(camera)
        self._skin = _parts(light * camera.skin_grey)
        self._contrast = _parts(light * (camera.marker_grey - camera.skin_grey))
        noise = self._rng.standard_normal(light.size + _PLACES, dtype=np.float32)
        self._noise = _parts(noise * np.float32(camera.noise_grey))
        self._stamps = _stamps(camera)
        self._sum = np.empty(light.shape, np.int16)

    def draw(self, position_px: Points) -> GreyImage:
        """Draw one frame.

        Parameters
        ----------
        position_px
            Centres of the discs, shape (n, 2), px.

        Returns
        -------
        GreyImage
            Shape (height, width), 0 to 255.
        """
        start = int(self._rng.integers(_PLACES))
        grey = np.empty(self._sum.shape, np.uint8)
        _light_skin(self._skin.ravel(), self._noise[start:], self._sum.ravel())
        position = np.asarray(position_px, np.float64)
        _add_discs(self._sum, self._contrast.ravel(), position, self._stamps)
        _expose(self._sum.ravel(), grey.ravel())
        return grey


def _parts(grey: NDArray[np.float32]) -> NDArray[np.int16]:
    """Return grey levels in whole parts of a level."""
    return np.rint(np.clip(grey, -_LOUDEST_GREY, _LOUDEST_GREY) * _PER_GREY).astype(np.int16)


def _light(camera: Camera) -> NDArray[np.float32]:
    """Return how brightly the ring lights each pixel, 1 in the middle, (height, width)."""
    y, x = np.indices((camera.height, camera.width))
    centre = camera.centre_px
    radius2 = ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / camera.outer_px**2
    return np.asarray(np.maximum(1 - camera.falloff * radius2, 0), np.float32)


@lru_cache(maxsize=4)
def _stamps(camera: Camera) -> NDArray[np.uint8]:
    """Return how much of each pixel round it a disc covers: (steps_y, steps_x, rows, columns).

    By the pixel's distance from the disc's edge: a straight edge, blurred by the lens and by the
    pixel's own width (1/sqrt(12) px); the disc's curve changes this by less than 1% of its
    contrast. The disc's centre is in pixel (rows // 2, columns // 2) or up to a pixel after it.
    """
    radius = camera.marker_diameter_mm * camera.px_per_mm / 2
    rows = 2 * math.ceil(radius + _REACH_PX) + 1
    columns = -(-rows // _LANES) * _LANES
    sigma = np.hypot(camera.blur_px, 12**-0.5)
    within = (np.arange(_STEPS, dtype=np.float32) + np.float32(0.5)) / np.float32(_STEPS)
    dy = np.arange(rows, dtype=np.float32) - rows // 2 - within[:, None]
    dx = np.arange(columns, dtype=np.float32) - columns // 2 - within[:, None]
    outside = np.sqrt(dy[:, None, :, None] ** 2 + dx[None, :, None, :] ** 2) - radius
    at = np.clip((outside + _REACH_PX) * _EDGE_STEPS, 0, 2 * _REACH_PX * _EDGE_STEPS)
    edge = np.arange(-_REACH_PX, _REACH_PX + 0.5 / _EDGE_STEPS, 1 / _EDGE_STEPS)
    cover = np.rint(_FULL * 0.5 * (1 - erf(edge / (sigma * 2**0.5)))).astype(np.uint8)
    return np.asarray(cover[at.astype(np.int16)], np.uint8)


@njit(cache=True)
def _light_skin(skin, noise, total):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the picture with skin and noise."""
    for i in range(len(total)):
        total[i] = skin[i] + noise[i]


@njit(cache=True)
def _add_discs(total, contrast, position, stamps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Light the pixels that discs cover."""
    height, width = total.shape
    flat = total.ravel()
    steps, rows, columns = stamps.shape[0], stamps.shape[2], stamps.shape[3]
    for i in range(len(position)):
        x, y = np.floor(position[i, 0]), np.floor(position[i, 1])
        # 255 parts of the contrast in 256: less than noise by far.
        stamp = stamps[int((position[i, 1] - y) * steps), int((position[i, 0] - x) * steps)]
        left, top = int(x) - columns // 2, int(y) - rows // 2
        first, last = max(0, -left), min(columns, width - left)
        for row in range(max(0, -top), min(rows, height - top)):
            at = (top + row) * width + left
            # Slices from 0: the compiler then works on many pixels at once.
            cover = stamp[row, first:last]
            pixels, lit = flat[at + first : at + last], contrast[at + first : at + last]
            for k in range(len(pixels)):
                parts = np.int32(cover[k]) * np.int32(lit[k]) + np.int32(128)
                pixels[k] += np.int16(parts >> np.int32(8))


@njit(cache=True)
def _expose(total, grey):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Round to grey levels."""
    for i in range(len(total)):
        value = (total[i] + np.int16(16)) >> np.int16(5)
        grey[i] = np.uint8(min(max(value, np.int16(0)), np.int16(255)))

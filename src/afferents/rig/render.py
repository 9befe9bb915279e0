"""Pictures of the pins: white discs on dark skin, as the camera's sensor sees them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import erf

from afferents.core.recording import GreyImage
from afferents.rig.camera import Camera, Points

_NOISE_POOL = 1 << 21
"""Noise is drawn once and read from another place for each frame: two million values."""
_EDGE_STEPS = 64
"""Values a px in the table of a disc's edge."""
_REACH_PX = 3.0
"""The edge of a disc is blurred no farther than this."""


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
        self._light = _light(camera)
        self._skin = (self._light * camera.skin_grey).astype(np.float32)
        self._contrast = (self._light * (camera.marker_grey - camera.skin_grey)).astype(np.float32)
        noise = self._rng.standard_normal(_NOISE_POOL, dtype=np.float32)
        self._noise = noise * np.float32(camera.noise_grey)
        self._edge = _edge(camera)

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
        image = self._skin.copy()
        radius = self.camera.marker_diameter_mm * self.camera.px_per_mm / 2
        _add_discs(image, self._contrast, np.asarray(position_px, np.float64), radius, self._edge)
        grey = np.empty(image.shape, np.uint8)
        start = int(self._rng.integers(_NOISE_POOL - image.size))
        _expose(image.ravel(), self._noise, start, grey.ravel())
        return grey


def _light(camera: Camera) -> NDArray[np.float32]:
    """Return how brightly the ring lights each pixel, 1 in the middle, (height, width)."""
    y, x = np.indices((camera.height, camera.width))
    centre = camera.centre_px
    radius2 = ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / camera.outer_px**2
    return np.asarray(np.maximum(1 - camera.falloff * radius2, 0), np.float32)


def _edge(camera: Camera) -> NDArray[np.float32]:
    """Return how much of a pixel a disc covers, by the pixel's distance from the disc's edge.

    A straight edge, blurred by the lens and by the pixel's own width (1/sqrt(12) px); the disc's
    curve changes this by less than 1% of its contrast.
    """
    sigma = np.hypot(camera.blur_px, 12**-0.5)
    outside = np.arange(-_REACH_PX, _REACH_PX, 1 / _EDGE_STEPS)
    return np.asarray(0.5 * (1 - erf(outside / (sigma * 2**0.5))), np.float32)


@njit(cache=True)
def _add_discs(image, contrast, position, radius, edge):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Light the pixels that discs cover."""
    height, width = image.shape
    reach = radius + _REACH_PX
    for i in range(len(position)):
        x, y = position[i, 0], position[i, 1]
        for row in range(max(0, int(y - reach)), min(height, int(y + reach) + 2)):
            for column in range(max(0, int(x - reach)), min(width, int(x + reach) + 2)):
                outside = np.sqrt((column - x) ** 2 + (row - y) ** 2) - radius
                if outside < _REACH_PX - 1 / _EDGE_STEPS:
                    cover = np.float32(1)
                    if outside > -_REACH_PX:
                        cover = edge[int((outside + _REACH_PX) * _EDGE_STEPS)]
                    image[row, column] += cover * contrast[row, column]


@njit(cache=True, fastmath=True)
def _expose(image, noise, start, grey):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add noise and round to grey levels."""
    for i in range(len(image)):
        value = image[i] + noise[start + i] + np.float32(0.5)
        grey[i] = np.uint8(min(max(value, np.float32(0)), np.float32(255)))

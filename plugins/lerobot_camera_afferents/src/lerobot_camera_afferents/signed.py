"""Vectors of the skin as an image: how far markers are displaced, and how fast that changes."""

import math

import numpy as np
from numpy.typing import NDArray

from afferents.lab.live.touch import Pixels, Touch
from afferents.markers.places import make_images
from lerobot_camera_afferents.config_camera import SHOWS

MIDDLE, MOST = 128, 127
"""Of a pixel: what stands for 0, and how far from that the scale's end lies."""


def draw_signed(touch: Touch, most_px: float) -> Pixels:
    """Return displacement and its change as signed values round 128.

    Parameters
    ----------
    touch
        What a frame shows.
    most_px
        What 255 stands for; 1 stands for as much to the other side, larger values are clipped.

    Returns
    -------
    NDArray
        (row, column, 3), uint8, a pixel a marker: displacement in x (right) and y (down), px, and
        by how much the distance from rest has grown since the frame before, px/frame: RA-I, with
        its sign. 128 where a marker is lost, or none stands; the last one where no frame came
        before, too.
    """
    now, before = touch.now, touch.before
    grown = now.distance - (math.nan if before is None else before.distance)
    values = np.vstack([now.displacement.T, grown])
    image = np.nan_to_num(make_images(values, touch.grid.row, touch.grid.column))
    levels = MIDDLE + MOST * np.clip(image / most_px, -1, 1)
    return np.moveaxis(np.rint(levels), 0, 2).astype(np.uint8)


def read_signed(image: Pixels, most_px: float = SHOWS["signed"]) -> NDArray[np.float32]:
    """Return what an image of `draw_signed` says.

    Parameters
    ----------
    image
        (..., 3), uint8.
    most_px
        As the camera was given.

    Returns
    -------
    NDArray
        (..., 3): displacement in x and y, px, and by how much its length has grown, px/frame.
    """
    return (np.asarray(image, np.float32) - MIDDLE) * np.float32(most_px / MOST)

"""Cells of the picture, which stand where markers would: for fingertips without any."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.markers import detect, grid, rest, windowed
from afferents.markers.sensor import FEWEST, Sensor
from afferents.store.recording import Frame, GreyImage, make_grey

STILL = 2.0
"""Where pictures differ more from the first, in grey levels over all pixels, the skin moves."""


class Cells:
    """Says how far each cell of a picture is from rest, where a `Tracker` says where markers are.

    SA-I of a cell is the mean of |I - I at rest| over its pixels, I their grey levels, 0 to 255;
    colours are not used. A cell whose pixels are all hidden is left out.

    Parameters
    ----------
    frames
        That show the skin at rest; their median counts, up to where the skin moves.
    sensor
        Says how many rows and columns of cells the upright picture has.
    where
        The video, for the error.

    Attributes
    ----------
    rest_position
        Middle of the pixels of each cell, (n, 2), px; it never moves.
    grid
        Their rows and columns.
    first
        What the first of the frames says.

    Raises
    ------
    InputError
        If hardly any cell has pixels that are not hidden.
    """

    jump_px, renamed, audit = 0.0, None, windowed.Audit()

    def __init__(self, frames: Sequence[Frame], sensor: Sensor, where: object) -> None:
        """Take the frames for the skin at rest."""
        assert sensor.rows is not None
        assert sensor.columns is not None
        self._levels = frames[0].levels
        images = [frame.image for frame in frames[: rest.N_FRAMES]]
        off = [cv2.norm(image, images[0], cv2.NORM_L1) / image.size for image in images]
        n_still = int(np.argmax(np.array(off) > STILL)) or len(images)
        self._rest = rest.median_picture(images[:n_still])
        y, x = np.indices(self._rest.shape).reshape(2, -1)
        pixel = np.stack([x, y], axis=1).astype(np.float64)
        up = detect.turned(pixel, sensor) + 0.5
        column, row = (up * (sensor.columns, sensor.rows) / (up.max(axis=0) + 0.5)).T.astype(int)
        self._n = sensor.rows * sensor.columns
        self._cell = np.where(sensor.picture.shows(pixel), row * sensor.columns + column, self._n)
        self._n_pixels = self._sums(np.ones_like(self._rest))
        self._kept = np.flatnonzero(self._n_pixels)
        if len(self._kept) < FEWEST:
            raise InputError(
                f"{where}: expected {FEWEST} cells or more of sensor '{sensor.name}' in the "
                f"picture, found {len(self._kept)}; let keep and hide in the sensor file leave more"
            )
        self.rest_position = np.stack([self._mean(axis) for axis in (x, y)], axis=1)
        self._present = np.ones(len(self._kept), dtype=bool)
        self.grid = grid.Grid(*np.divmod(self._kept, sensor.columns), roll_deg=0.0)
        self.first = self.step(frames[0].luma)

    def step(self, image: GreyImage) -> windowed.Tracked:
        """Return what the next frame says: luma, (height, width), uint8."""
        off = cv2.absdiff(make_grey(image, self._levels), self._rest)
        return windowed.Tracked(self.rest_position, self._present, self._mean(off))

    def _mean(self, values: NDArray[np.generic]) -> NDArray[np.float64]:
        """Return the mean of what pixels show over each cell, (n,)."""
        return (self._sums(values) / np.maximum(self._n_pixels, 1))[self._kept]

    def _sums(self, values: NDArray[np.generic]) -> NDArray[np.float64]:
        return np.asarray(np.bincount(self._cell, values.ravel(), self._n + 1)[: self._n], float)

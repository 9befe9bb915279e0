"""SA-I and RA-I as tactile images, frame by frame: the same numbers as offline, bit by bit."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.recording import Frame
from afferents.markers import Grid, Positions, Sensor, Tracker, check_size, undistort

Image = NDArray[np.float32]


class Felt(NamedTuple):
    """What one frame shows.

    Attributes
    ----------
    sa1
        SA-I image (row, column), px; lost markers hold what they last showed.
    ra1
        RA-I image, px/frame; None where no frame came just before.
    position
        Of the markers as the camera sees them, (n, 2), px, NaN where lost.
    detected
        Which were found, (n,).
    """

    sa1: Image
    ra1: Image | None
    position: NDArray[np.float64]
    detected: NDArray[np.bool_]


class Images:
    """Follows the markers of a stream of frames.

    Parameters
    ----------
    sensor
        With a grid layout; the frame `sensor.rest_frame` is taken for the skin at rest.

    Raises
    ------
    InputError
        If the layout is no grid.
    """

    def __init__(self, sensor: Sensor) -> None:
        """Wait for the rest frame."""
        if sensor.layout != "square":
            raise InputError("the model", "a sensor with markers in a grid", sensor.layout)
        assert sensor.rows is not None
        assert sensor.columns is not None
        self.sensor, self.shape = sensor, (sensor.rows, sensor.columns)
        self.begin()

    def begin(self) -> None:
        """Begin anew: the next frame is the first of a recording."""
        self._tracker: Tracker | None = None
        self._n = 0
        n_markers = self.shape[0] * self.shape[1]
        self._slow, self._rapid = np.zeros(n_markers), np.zeros(n_markers)
        self._before: NDArray[np.float64] | None = None

    def skip(self) -> None:
        """Frames are missing before the next one: it has no RA-I."""
        self._before = None

    def feed(self, frame: Frame) -> Felt | None:
        """Take in the next frame; None before the rest frame.

        Raises
        ------
        InputError
            If the rest frame does not show the sensor's markers, or is of another size.
        """
        self._n += 1
        if self._n <= self.sensor.rest_frame:
            return None
        if self._tracker is None:
            check_size("the pictures", frame.luma.shape[::-1], self.sensor)
            self._tracker = Tracker(self.sensor, levels=frame.levels)
        position, detected = self._tracker.step(frame.luma)
        slow = self._displacement(position, self._tracker.rest_position)
        rapid = None if self._before is None else np.abs(slow - self._before)
        self._before = slow
        grid = self._tracker.grid
        return Felt(
            self._image(_held(slow, self._slow), grid),
            None if rapid is None else self._image(_held(rapid, self._rapid), grid),
            position,
            detected,
        )

    def _displacement(self, position: Positions, rest: Positions) -> NDArray[np.float64]:
        """Return SA-I (Eq. 1), as `channels.sa1` computes it."""
        if (lens := self.sensor.lens) is not None:
            position, rest = undistort(position, lens), undistort(rest, lens)
        return np.asarray(((position - rest) ** 2).sum(axis=1) ** 0.5)

    def _image(self, response: NDArray[np.float64], grid: Grid | None) -> Image:
        image = np.zeros(self.shape, np.float32)
        assert grid is not None
        image[grid.row, grid.column] = response
        return image


def _held(response: NDArray[np.float64], last: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill what lost markers leave open with what they last showed, and keep it in `last`."""
    seen = ~np.isnan(response)
    last[seen] = response[seen]
    return last

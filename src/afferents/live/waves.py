"""Waves in a stream of tactile images: the same numbers as offline."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from afferents.encodings import WavenumberEncoding, log_waves

Image = NDArray[np.float32]


class Waves:
    """Keeps the last run of images and tells which waves stand in them, at every frame.

    Offline a run follows the other; here each frame ends one.

    Parameters
    ----------
    encoding
        How long a run is.
    memory
        See `encodings.wavenumber_samples`.
    """

    def __init__(self, encoding: WavenumberEncoding, memory: int) -> None:
        """Wait for the first run to fill."""
        self._memory = memory
        self._run: deque[Image] = deque(maxlen=encoding.frames)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next, and no run may hold both sides."""
        self._run.clear()

    def feed(self, image: Image) -> NDArray[np.float32] | None:
        """Return the waves of the run that an image ends; None until a run is full.

        Parameters
        ----------
        image
            (row, column), or (component, row, column) of a vector.
        """
        self._run.append(image if image.ndim == 3 else image[np.newaxis])
        if len(self._run) < (self._run.maxlen or 0):
            return None
        return log_waves(np.stack(self._run), self._memory)

"""Waves in a stream of tactile images: the same numbers as offline."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from afferents.encodings import WavenumberEncoding, log_waves, wave_spectra

Image = NDArray[np.float32]


class Waves:
    """Keeps the spectra of the last run of images and tells at every frame which waves it holds.

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
        self._spectra: deque[NDArray[np.complex64]] = deque(maxlen=encoding.frames)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next, and no run may hold both sides."""
        self._spectra.clear()

    def feed(self, image: Image) -> NDArray[np.float32] | None:
        """Return the waves of the run that an image ends; None until a run is full.

        Parameters
        ----------
        image
            (row, column), or (component, row, column) of a vector.
        """
        self._spectra.append(wave_spectra(image if image.ndim == 3 else image[np.newaxis]))
        if len(self._spectra) < (self._spectra.maxlen or 0):
            return None
        return log_waves(np.stack(self._spectra), self._memory)

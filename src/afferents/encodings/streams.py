"""Samples made live: from images or vibration as they come."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


class ImageStream(Protocol):
    """An encoding of images that come one after the other."""

    def skip(self) -> None:
        """Begin anew: images are missing before the next, and no sample may hold both sides."""

    def feed(self, image: Floats) -> Floats | None:
        """Return the sample that an image ends, if it ends one."""


class Ready(NamedTuple):
    """A sample of vibration that is complete.

    Attributes
    ----------
    values
        As the model takes it.
    end_s
        When its last value was taken, plus one period, s.
    """

    values: Floats
    end_s: float


class VibrationStream(Protocol):
    """An encoding of vibration that comes in pieces."""

    def skip(self) -> None:
        """Begin anew: values are missing before the next, and no sample may hold both sides."""

    def feed(self, time_s: float, samples: Floats) -> list[Ready]:
        """Take in values (n, channel), the first taken at `time_s`; return what is ready."""

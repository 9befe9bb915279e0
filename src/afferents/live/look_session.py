"""Looking on without a model: percepts that say when, how well, and nothing of texture."""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.live.events import Channel
from afferents.live.images import FrameImages
from afferents.live.percept import Counters, Percept
from afferents.live.quality import Quality
from afferents.live.session import Session

NAMES: dict[Channel, str] = {"video": "camera", "audio": "microphone"}
"""That percepts carry where a model's would be."""


class LookSession(Session):
    """Says of every sample that it came, and of what quality the sense is.

    Parameters
    ----------
    channel
        Of the sense.
    counters, quality
        As for `Session`.
    """

    def __init__(self, channel: Channel, counters: Counters, quality: Quality) -> None:
        """Name it after what is looked at."""
        super().__init__(NAMES[channel], counters, quality)

    def introduction(self) -> dict[str, Any]:
        """Return what a page says of it once, ready for JSON."""
        title = self.name.title()
        return {"model": self.name, "title": title, "textures": [], "description": []}

    def skip(self) -> None:
        """Nothing is kept from one sample to the next."""

    def see(self, felt: FrameImages, time_s: float, every_s: float, arrived_s: float) -> Percept:
        """Say how many of a frame's markers are found."""
        return self._looked(time_s, arrived_s, markers_found=float(felt.detected.mean()))

    def feel(
        self, sample: NDArray[np.float32], time_s: float, every_s: float, arrived_s: float
    ) -> Percept:
        """Say that a sample came."""
        return self._looked(time_s, arrived_s)

    def _looked(self, time_s: float, arrived_s: float, **found: float) -> Percept:
        latency_ms = 1000 * (time.monotonic() - arrived_s)
        return self._percept("looking", time_s, latency_ms=latency_ms, **found)

"""How good a microphone's sound is: its level, and whether it is clipped or silent."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from afferents.live.events import Sound
from afferents.live.quality import SPAN_S, Figure, Quality
from afferents.recordings import clipped_share


class AudioQuality(Quality):
    """Figures of a microphone.

    Its numbers are ``peak`` and ``rms`` of the loudest channel, as shares of full scale, and
    ``clipped``, the largest share of samples that is cut off in any channel.

    Parameters
    ----------
    rate_hz
        Samples a second.
    """

    def __init__(self, rate_hz: float) -> None:
        """Nothing has come yet."""
        super().__init__()
        self._rate_hz = rate_hz
        self.begin()

    def begin(self) -> None:
        """Forget all: another recording begins."""
        self.numbers = {}
        self._due_s = None
        self._pieces: deque[NDArray[np.float32]] = deque()
        self._n = 0

    def take(self, sound: Sound) -> None:
        """Take in some samples."""
        self._pieces.append(sound.samples)
        self._n += len(sound.samples)
        while self._n - len(self._pieces[0]) >= SPAN_S * self._rate_hz:
            self._n -= len(self._pieces.popleft())
        if self._is_due(sound.time_s):
            samples = np.concatenate(self._pieces).astype(float)
            self.numbers = {
                "peak": float(np.abs(samples).max()),
                "rms": float(np.sqrt((samples**2).mean(axis=0)).max()),
                "clipped": max(clipped_share(channel) for channel in samples.T),
            }

    def figures(self) -> list[Figure]:
        """Return them in words, for people."""
        if not self.numbers:
            return []
        peak, rms, clipped = (self.numbers[name] for name in ("peak", "rms", "clipped"))
        silent = "It is silent: look at the microphone and its cable." if peak == 0 else ""
        loud = "Samples are clipped: lower the gain." if clipped > 0 else ""
        return [
            Figure("sound level", _decibels(rms), silent),
            Figure("loudest", _decibels(peak)),
            Figure("clipped", f"{100 * clipped:.3g}% of samples", loud),
        ]


def _decibels(share: float) -> str:
    """Return a share of full scale in dB."""
    return f"{20 * math.log10(share):.0f} dBFS" if share > 0 else "silent"

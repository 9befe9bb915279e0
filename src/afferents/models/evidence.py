"""Evidence over time: probabilities of many uncertain samples of one touch, joined."""

import math

import numpy as np
from numpy.typing import NDArray

MEMORY_S = 3.0
"""Evidence fades by 1/e in this time, s: what is touched may change."""
SURE = 0.95
"""A texture is sure from this probability on."""
_LEAST = 1e-6


class EvidenceAccumulator:
    """A leaky sum of log-probabilities, and since when it names one texture.

    Parameters
    ----------
    n_classes
        Number of textures.
    per_s
        How many samples' worth a second of touch is; see `models.card.Card`.
    """

    def __init__(self, n_classes: int, per_s: float) -> None:
        """Start with all textures as likely."""
        self._n_classes, self._per_s = n_classes, per_s
        self.reset()

    def reset(self) -> None:
        """Forget all: another touch begins."""
        self._sum = np.zeros(self._n_classes)
        self._last_s: float | None = None
        self._faded_s: float | None = None
        self._since_s: float | None = None
        self._sure_s: float | None = None
        self._leader = -1

    @property
    def logs(self) -> NDArray[np.float64]:
        """Their logarithms, but for a constant, shape (n_classes,)."""
        return self._sum.copy()

    @property
    def probabilities(self) -> NDArray[np.float64]:
        """Of each texture by all evidence, shape (n_classes,)."""
        powers = np.exp(self._sum - self._sum.max(initial=-np.inf))
        return np.asarray(powers / powers.sum())

    @property
    def sure_after_s(self) -> float | None:
        """Time from the beginning of the touch until one texture had 95%; None before that.

        A touch begins with the first sample, or when another texture takes over from a sure one.
        """
        if self._sure_s is None or self._since_s is None:
            return None
        return self._sure_s - self._since_s

    def add(self, time_s: float, probabilities: NDArray[np.floating], lasts_s: float) -> None:
        """Add a sample.

        Parameters
        ----------
        time_s
            Its end, s.
        probabilities
            Shape (n_classes,).
        lasts_s
            How much new touch it shows at most, s: the stride of the samples.
        """
        self.fade(time_s)
        new_s = lasts_s if self._last_s is None else min(lasts_s, time_s - self._last_s)
        self._last_s = time_s
        if self._since_s is None:
            self._since_s = time_s - lasts_s
        lasting_s = -MEMORY_S * math.expm1(-max(new_s, 0) / MEMORY_S)  # of which some has faded
        self._sum += self._per_s * lasting_s * np.log(np.maximum(probabilities, _LEAST))
        now = self.probabilities
        if int(now.argmax()) != self._leader:
            if self._sure_s is not None:  # something else is touched now
                self._since_s = time_s - lasts_s
            self._leader, self._sure_s = int(now.argmax()), None
        if now[self._leader] >= SURE and self._sure_s is None:
            self._sure_s = time_s

    def fade(self, time_s: float) -> None:
        """Forget some, for the time since the last sample."""
        if self._faded_s is not None and time_s > self._faded_s:
            self._sum *= math.exp((self._faded_s - time_s) / MEMORY_S)
        self._faded_s = time_s

"""Is a model right as often as it says? Confidence against accuracy (Guo et al., ICML 2017)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.core.results import PROBABILITY

N_BINS = 15
"""Of equal width, from 0 to 1."""


@dataclass(frozen=True)
class Reliability:
    """Samples gathered by confidence, the probability of what they are named.

    Attributes
    ----------
    count
        Samples in each bin, (bin,).
    confidence, accuracy
        Their mean confidence and the share named rightly, (bin,); 0 where there are none.
    """

    count: NDArray[np.int64]
    confidence: NDArray[np.float64]
    accuracy: NDArray[np.float64]

    @property
    def ece(self) -> float:
        """Expected calibration error: the mean over samples of their bin's difference, 0 to 1."""
        return float(self.count @ np.abs(self.accuracy - self.confidence) / self.count.sum())

    def describe(self) -> dict[str, Any]:
        """Return it as the summary holds it."""
        return {
            "ece": self.ece,
            "count": self.count.tolist(),
            "confidence": self.confidence.tolist(),
            "accuracy": self.accuracy.tolist(),
        }


def reliability(
    confidence: NDArray[np.floating], right: NDArray[np.bool_], n_bins: int = N_BINS
) -> Reliability:
    """Gather samples, at least one, by their confidence.

    Parameters
    ----------
    confidence
        Probability of what each sample is named, 0 to 1, (n,).
    right
        Whether that is what it is, (n,).
    n_bins
        A bin's upper edge belongs to it.
    """
    exact = np.clip(np.asarray(confidence, dtype=np.float64), 0, 1)
    number = np.clip(np.ceil(exact * n_bins).astype(np.int64) - 1, 0, n_bins - 1)
    count = np.bincount(number, minlength=n_bins)
    some = np.maximum(count, 1)
    return Reliability(
        count.astype(np.int64),
        np.bincount(number, exact, n_bins) / some,
        np.bincount(number, right, n_bins) / some,
    )


def reliability_of(predictions: pd.DataFrame) -> Reliability | None:
    """Return that of a table of predictions; None where it holds no probabilities."""
    columns = [name for name in predictions.columns if name.startswith(PROBABILITY)]
    if not columns or predictions.empty:
        return None
    right = predictions["true_texture"] == predictions["predicted_texture"]
    return reliability(predictions[columns].max(axis=1).to_numpy(), right.to_numpy())

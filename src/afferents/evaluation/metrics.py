"""Accuracy by held-out speed, its interval, confusion and macro-F1, from predictions."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.metrics import confusion_matrix, f1_score

RESAMPLES = 2000


@dataclass(frozen=True)
class Interval:
    """A 95% interval."""

    low: float
    high: float


def accuracy_by_speed(predictions: pd.DataFrame) -> dict[float, float]:
    """Return the fraction of test samples named rightly, for each held-out speed (mm/s).

    Several seeds are averaged.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    means = right.groupby(predictions["held_out_speed_mm_s"]).mean()
    return {float(str(speed)): float(mean) for speed, mean in means.items()}


def bootstrap_interval(predictions: pd.DataFrame, seed: int = 0) -> Interval:
    """95% percentile interval of the mean over speeds of the accuracy, by bootstrap.

    Recordings are drawn anew within each held-out speed, since samples of one recording are
    anything but independent; the speeds are those of the experiment and stay.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    keys = [predictions["held_out_speed_mm_s"], predictions["recording"]]
    table = right.groupby(keys).agg(["sum", "count"])
    rng = np.random.default_rng(seed)
    by_speed = []
    for _, recordings in table.groupby(level=0):
        counts = recordings.to_numpy(dtype=float)
        drawn = counts[rng.integers(0, len(counts), (RESAMPLES, len(counts)))].sum(axis=1)
        by_speed.append(drawn[:, 0] / drawn[:, 1])
    low, high = np.quantile(np.mean(by_speed, axis=0), [0.025, 0.975])
    return Interval(float(low), float(high))


def confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Return counts, shape (true texture, predicted texture)."""
    counts: NDArray[np.int64] = confusion_matrix(
        predictions["true_texture"], predictions["predicted_texture"], labels=textures
    )
    return counts


def macro_f1(predictions: pd.DataFrame, textures: list[str]) -> float:
    """Return the mean over textures of the F1 score, over all held-out speeds together."""
    return float(
        f1_score(
            predictions["true_texture"],
            predictions["predicted_texture"],
            labels=textures,
            average="macro",
            zero_division=0.0,
        )
    )

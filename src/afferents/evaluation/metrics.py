"""Accuracy by held-out speed, confusion and macro-F1, from predictions."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray


def accuracy_by_speed(predictions: pd.DataFrame) -> dict[float, float]:
    """Return the fraction of test samples named rightly, for each held-out speed (mm/s).

    Several seeds are averaged.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    means = right.groupby(predictions["held_out_speed_mm_s"]).mean()
    return {float(str(speed)): float(mean) for speed, mean in means.items()}


def confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Return counts, shape (true texture, predicted texture)."""
    from sklearn.metrics import confusion_matrix  # workers need none of it

    counts: NDArray[np.int64] = confusion_matrix(
        predictions["true_texture"], predictions["predicted_texture"], labels=textures
    )
    return counts


def macro_f1(predictions: pd.DataFrame, textures: list[str]) -> float:
    """Return the mean over textures of the F1 score, over all held-out speeds together."""
    from sklearn.metrics import f1_score

    return float(
        f1_score(
            predictions["true_texture"],
            predictions["predicted_texture"],
            labels=textures,
            average="macro",
            zero_division=0.0,
        )
    )

"""Accuracy by group held out (by default a speed), confusion and macro-F1, from predictions."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.core.split import Group, column_of, group_in, order


def accuracy_by_group(predictions: pd.DataFrame) -> dict[Group, float]:
    """Return the fraction of test samples named rightly, for each group held out, in order.

    Several seeds are averaged.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    means = right.groupby(predictions[column_of(predictions)]).mean()
    found = {group_in(value): float(mean) for value, mean in means.items()}
    return {group: found[group] for group in sorted(found, key=order)}


def confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Return counts, shape (true texture, predicted texture)."""
    from sklearn.metrics import confusion_matrix  # workers need none of it

    counts: NDArray[np.int64] = confusion_matrix(
        predictions["true_texture"], predictions["predicted_texture"], labels=textures
    )
    return counts


def macro_f1(predictions: pd.DataFrame, textures: list[str]) -> float:
    """Return the mean over textures of the F1 score, over all groups held out together."""
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

"""Occlusion: how much less likely the true texture is without a part of what was felt.

Zeiler & Fergus, Visualizing and understanding convolutional networks, ECCV 2014. It asks the model
itself, whatever it is made of, and its answer has a unit: the logarithm of the true texture's odds,
which unlike its probability does not stand still near 1.
"""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import logsumexp

Floats = NDArray[np.float32]
Predict = Callable[[Floats], NDArray[np.floating]]
"""What a model says of inputs: log-probabilities (n, n_classes)."""


def losses(
    predict: Predict,
    inputs: Floats,
    labels: NDArray[np.int64],
    masks: Iterable[NDArray[np.bool_]],
    instead: Floats,
) -> NDArray[np.float64]:
    """Return what the true textures lose in log-odds without each part, (part, n), nats.

    Parameters
    ----------
    inputs, labels
        (n, ...) and (n,).
    masks
        Of each part, of the inputs' last dimensions: True for what is taken away.
    instead
        What stands there then, of the inputs' shape without n, or one that goes with it.

    Returns
    -------
    Positive where the part speaks for the true texture.
    """
    whole = log_odds(predict(inputs), labels)
    found = [
        whole - log_odds(predict(np.where(mask, instead, inputs).astype(np.float32)), labels)
        for mask in masks
    ]
    return np.asarray(found, dtype=np.float64)


def log_odds(logs: NDArray[np.floating], labels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return log p - log (1 - p) of the true textures, (n,), from (n, n_classes) of log p."""
    is_true = np.arange(logs.shape[1]) == labels[:, None]
    others = np.where(is_true, -np.inf, logs)
    return np.asarray(logs[is_true] - logsumexp(others, axis=1), dtype=np.float64)


def patches(shape: tuple[int, int], size: int) -> list[NDArray[np.bool_]]:
    """Return a square patch of a grid round each of its places, (row, column), row by row."""
    row, column = np.indices(shape)
    half = size // 2
    return [
        (abs(row - r) <= half) & (abs(column - c) <= half)
        for r in range(shape[0])
        for c in range(shape[1])
    ]


def neighbourhoods(
    row: NDArray[np.generic], column: NDArray[np.generic], size: int
) -> list[NDArray[np.bool_]]:
    """Return each marker with its nearest, `size` in all, by the places of markers, (marker,)."""
    place = np.stack([row, column], axis=1).astype(np.float64)
    _, near = cKDTree(place).query(place, k=min(size, len(place)))
    return [np.isin(np.arange(len(place)), own) for own in near]


def bands(n: int, width: int) -> list[NDArray[np.bool_]]:
    """Return bands of an axis of n bins, side by side, the last perhaps narrower."""
    at = np.arange(n)
    return [at // width == k for k in range(-(-n // width))]

"""Probabilities that are right as often as they say: what unseen speeds teach of them."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.special import log_softmax

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_LOG_TEMPERATURES = (-5.0, 5.0)
_LOG_WEIGHTS = (-4.0, 4.0)


def cross_entropy(logs: Floats, labels: Indices) -> float:
    """Return the mean of -log p of the true textures, (n, n_classes) and (n,); logits will do."""
    return -float(log_softmax(logs, axis=1)[np.arange(len(labels)), labels].mean())


def fit_temperature(logs_at: Callable[[float], Floats], labels: Indices) -> float:
    """Return the temperature under which the true textures are most likely.

    Parameters
    ----------
    logs_at
        Log-probabilities, or logits, (n, n_classes), at a temperature; of samples not learnt from.
    labels
        Their textures, (n,).
    """
    found = minimize_scalar(
        lambda log_temperature: cross_entropy(logs_at(float(np.exp(log_temperature))), labels),
        bounds=_LOG_TEMPERATURES,
        method="bounded",
    )
    return float(np.exp(found.x))


def best_weights(parts: list[Floats], labels: Indices) -> Floats:
    """Return the weights, above 0, under which the sum of log-probabilities losses least.

    Parameters
    ----------
    parts
        Of every part (n, n_classes), of samples not learnt from; what is missing is 0.
    labels
        Their textures, (n,).
    """
    found = minimize(
        lambda log_weights: cross_entropy(weighted(parts, np.exp(log_weights)), labels),
        np.zeros(len(parts)),
        bounds=[_LOG_WEIGHTS] * len(parts),
        method="L-BFGS-B",
    )
    return np.asarray(np.exp(found.x))


def weighted(parts: list[Floats], weights: Floats) -> Floats:
    """Return the log-probabilities (n, n_classes) that several parts together give."""
    total = np.sum([w * part for w, part in zip(weights, parts, strict=True)], axis=0)
    return np.asarray(log_softmax(total, axis=1))

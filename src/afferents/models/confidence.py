"""How sure to be: calibrated probabilities, and 'none of these'."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.special import log_softmax
from torch import Tensor, nn

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


# How far a sample lies from all that was learnt: the way a model says 'none of these'.
#
# Novelty is the smallest Mahalanobis distance to a class's mean, with one covariance for all
# classes (Lee et al., NeurIPS 2018), over the distance that few known samples exceed. Above 1
# nothing that was learnt fits.
#
# It is taken where textures lie apart most: of a network in its last features, of a ridge in its
# scores of the textures. That was chosen on a tuning session, by the area under the ROC curve: the
# ridge's values themselves, distances relative to that of all textures together (Ren et al., 2021),
# and the largest probability were each worse.

KNOWN = 0.95
"""Share of samples, of textures known at a speed not learnt from, whose novelty is below 1."""
_RIDGE = 1e-2
"""Share of the mean variance that is added to the covariance: dead features have none."""
_LEAST_VARIANCE = 1e-12
"""Where no class varies, as with one sample of each: then all else is far."""


class Novelty(nn.Module):
    """Novelty of what a model makes of samples.

    Parameters
    ----------
    n_classes, n_features
        Number of textures, and of values a sample; scores of the textures are as many as these.
    """

    means: Tensor
    whitening: Tensor
    limit: Tensor

    def __init__(self, n_classes: int, n_features: int) -> None:
        """Start with nothing known."""
        super().__init__()
        self.register_buffer("means", torch.zeros(n_classes, n_features))
        self.register_buffer("whitening", torch.eye(n_features))
        self.register_buffer("limit", torch.ones(()))

    def forward(self, values: Tensor) -> Tensor:
        """Return the novelty (n,) of values (n, feature); above 1 is unknown."""
        return self.distance(values) / self.limit

    def distance(self, values: Tensor) -> Tensor:
        """Return the smallest Mahalanobis distance (n,) of values (n, feature) to a class."""
        off = (values.unsqueeze(1) - self.means) @ self.whitening
        return off.square().sum(2).min(1).values.sqrt()

    @torch.no_grad()
    def fit(self, values: Tensor, labels: Tensor, unseen: Tensor) -> None:
        """Learn what is known from training samples, and of unseen ones the limit; in place.

        Parameters
        ----------
        values, labels
            Of training samples, (n, feature) and (n,); no class may be without any.
        unseen
            Values of samples that were not learnt from, (m, feature): `KNOWN` of them are below 1.
        """
        self.means = torch.stack([values[labels == c].mean(0) for c in range(len(self.means))])
        within = (values - self.means[labels]).double()
        covariance = within.T @ within / len(within)
        variance = covariance.diagonal().mean().clamp_min(_LEAST_VARIANCE)
        ridge = _RIDGE * variance * torch.eye(len(covariance))
        # A factor of the inverse of the covariance that all classes share.
        self.whitening = torch.linalg.cholesky(torch.linalg.inv(covariance + ridge)).float()
        self.limit = torch.quantile(self.distance(unseen), KNOWN)

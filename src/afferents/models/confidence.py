"""How sure to be: calibrated probabilities, evidence over time, and 'none of these'."""

import math
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
        return nearest(values, self.means, self.whitening)

    @torch.no_grad()
    def fit(self, values: Tensor, labels: Tensor, unseen: Tensor) -> None:
        """Learn what is known from training samples, and of unseen ones the limit; in place.

        Parameters
        ----------
        values, labels
            Of training samples, (n, feature) and (n,).
        unseen
            Values of samples that were not learnt from, (m, feature).
        """
        self.fit_classes(values, labels)
        self.set_limit(self.distance(unseen))

    @torch.no_grad()
    def fit_classes(self, values: Tensor, labels: Tensor) -> None:
        """Learn the classes from training samples, (n, feature) and (n,), in place."""
        self.means, self.whitening = class_moments(values, labels, len(self.means))

    @torch.no_grad()
    def set_limit(self, distances: Tensor) -> None:
        """Set the limit that `KNOWN` of the distances (m,) of known but unseen samples keep to."""
        self.limit = torch.quantile(distances, KNOWN)


def nearest(values: Tensor, means: Tensor, whitening: Tensor) -> Tensor:
    """Return the distance (n,) of values (n, feature) to the nearest of some means.

    Parameters
    ----------
    means
        (class, feature).
    whitening
        (feature, feature), as of `class_moments`.
    """
    off = (values.unsqueeze(1) - means) @ whitening
    return off.square().sum(2).min(1).values.sqrt()


def class_moments(values: Tensor, labels: Tensor, n_classes: int) -> tuple[Tensor, Tensor]:
    """Return the classes' means and what whitens their common covariance.

    Parameters
    ----------
    values, labels
        Of samples, (n, feature) and (n,); none of the classes is empty.

    Returns
    -------
    means, whitening
        (class, feature), and (feature, feature): a factor of the inverse of the covariance.
    """
    means = torch.stack([values[labels == c].mean(0) for c in range(n_classes)])
    within = (values - means[labels]).double()
    covariance = within.T @ within / len(within)
    variance = covariance.diagonal().mean().clamp_min(_LEAST_VARIANCE)
    ridge = _RIDGE * variance * torch.eye(len(covariance))
    return means, torch.linalg.cholesky(torch.linalg.inv(covariance + ridge)).float()


# Evidence over time: what many uncertain samples of one touch say together.

MEMORY_S = 3.0
"""Evidence fades by 1/e in this time, s: what is touched may change."""


SURE = 0.95
"""A texture is sure from this probability on."""


_LEAST = 1e-6


class Evidence:
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
        """What all evidence says, shape (n_classes,)."""
        powers = np.exp(self._sum - self._sum.max())
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
        """Take in what a sample says.

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

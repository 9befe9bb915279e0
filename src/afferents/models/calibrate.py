"""What a model needs to be felt with: right probabilities, evidence over time, and 'unknown'.

All of it is set by a speed that nothing was learnt from.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import softmax
from torch import Tensor

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.folds.protocol import Fold, Indices
from afferents.models.confidence import cross_entropy, fit_temperature
from afferents.models.evidence import SURE, EvidenceAccumulator
from afferents.models.folder import Deployed
from afferents.models.learning_set import LearningSet

Floats = NDArray[np.float64]

_BATCH = 256
_EVIDENCE_PER_S = np.geomspace(0.05, 100, 45)
_FARTHEST = 15.0
"""Logarithm of the largest factor that a temperature is raised by: then all textures are alike."""


class Calibration(NamedTuple):
    """What the speed says that nothing was learnt from; see `Card`."""

    temperature: float
    evidence_per_s: float
    validation_accuracy: float
    validation_ci95: tuple[float, float]
    most_sure: float


@torch.no_grad()
def calibrate_model(
    deployed: Deployed, learnt: LearningSet, fold: Fold, samples: Samples
) -> Calibration:
    """Set a network's temperature and what it knows, in place."""
    train, held = torch.from_numpy(learnt.train), torch.from_numpy(fold.validation)
    unseen = _last_features(deployed, learnt.values, held)
    deployed.fit_novelty(
        _last_features(deployed, learnt.values, train), learnt.labels[train], unseen
    )
    labels = learnt.labels[held].numpy()
    recording = samples[dims.RECORDING].values[fold.validation]
    n = len(np.unique(recording))
    most_shown = most_that_can_show(n)
    logits = deployed.network.scores_of(unseen).double().numpy()
    temperature = fit_temperature(lambda temperature: logits / temperature, labels)
    temperature = softened(logits, temperature, most_shown)
    deployed.temperature = torch.tensor(temperature)
    probabilities = deployed.outcome(unseen)[0].double().numpy()
    stop_s = samples[dims.STOP].values[fold.validation]
    per_s, right_when_sure = best_evidence(probabilities, labels, recording, stop_s)
    accuracy = float((probabilities.argmax(1) == labels).mean())
    interval = interval_of(accuracy, n)
    most_sure = min(right_when_sure, interval[1], most_shown)
    return Calibration(temperature, per_s, accuracy, interval, most_sure)


def most_that_can_show(n: int) -> float:
    """Return how often a model is right that was right of n recordings of n.

    The median under a uniform prior: it is as likely too high as too low.
    """
    return float(0.5 ** (1 / (n + 1)))


def softened(logits: Floats, temperature: float, most: float) -> float:
    """Return the temperature, or the lowest at which the likeliest has `most` in the mean.

    Where all of a few samples are right, the fitted temperature is as low as it may be, and
    probabilities say 100%.
    """

    def above(log_temperature: float) -> float:
        said = softmax(logits / math.exp(log_temperature), axis=1)
        return float(said.max(axis=1).mean()) - most

    least = math.log(temperature)
    if above(least) <= 0:
        return temperature
    return math.exp(brentq(above, least, least + _FARTHEST))


def interval_of(share: float, n: int) -> tuple[float, float]:
    """Return the 95% interval of a share of n recordings (Wilson, 1927)."""
    z = 1.96
    middle, spread = share + z**2 / (2 * n), share * (1 - share) / n + (z / (2 * n)) ** 2
    low, high = ((middle + way * z * math.sqrt(spread)) / (1 + z**2 / n) for way in (-1, 1))
    return max(0.0, low), min(1.0, high)


def _last_features(deployed: Deployed, values: Tensor, index: Tensor) -> Tensor:
    """Return what enters the last layer for some samples, (n, feature)."""
    parts = torch.split(index, _BATCH)
    return torch.cat([deployed.last_features(values.index_select(0, part)) for part in parts])


def best_evidence(
    probabilities: Floats, labels: Indices, recording: NDArray[Any], stop_s: Floats
) -> tuple[float, float]:
    """Return how many samples' worth of evidence a second is, and how often it is right when sure.

    The first is that under which the true textures are most likely, whenever one looks. The second
    is the share of samples at which the texture that has 95% of the evidence is the true one (see
    `EvidenceAccumulator`); 1 where none has.

    Parameters
    ----------
    probabilities, labels, recording, stop_s
        Of samples not learnt from, recording by recording in the order of time.
    """
    every_s = _stride(stop_s, recording)
    logs = np.empty_like(probabilities)
    for name in np.unique(recording):
        evidence = EvidenceAccumulator(probabilities.shape[1], per_s=1.0)
        for k in np.flatnonzero(recording == name):
            evidence.add(float(stop_s[k]), probabilities[k], every_s)
            logs[k] = evidence.logs
    losses = [cross_entropy(per_s * logs, labels) for per_s in _EVIDENCE_PER_S]
    per_s = float(_EVIDENCE_PER_S[np.argmin(losses)])
    said = softmax(per_s * logs, axis=1)
    sure = said.max(axis=1) >= SURE
    right = said.argmax(axis=1) == labels
    return per_s, float(right[sure].mean()) if sure.any() else 1.0


def _stride(stop_s: Floats, recording: NDArray[Any]) -> float:
    """Return the usual time between samples of one recording, s."""
    steps = np.diff(stop_s)[recording[1:] == recording[:-1]]
    return float(np.median(steps)) if len(steps) else 1.0

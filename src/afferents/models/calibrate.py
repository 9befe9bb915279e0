"""Calibration of a model by a speed that nothing was learnt from.

It sets how sure the model is: probabilities that are right as often as they say, how much evidence
a second of touch is, and from which novelty on a sample is unknown.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.special import log_softmax, softmax

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.folds.protocol import Fold, Indices
from afferents.models.deployed import Deployed
from afferents.models.evidence import SURE, EvidenceAccumulator
from afferents.models.learning_set import LearningSet

Floats = NDArray[np.float64]

_BATCH = 256
_LOG_TEMPERATURES = (-5.0, 5.0)
_EVIDENCE_PER_S = np.geomspace(0.05, 100, 45)
_FARTHEST = 15.0
"""Logarithm of the largest factor that a temperature is raised by: then all textures are alike."""


class Calibration(NamedTuple):
    """What the speed that nothing was learnt from sets; see `Card`."""

    temperature: float
    evidence_per_s: float
    validation_accuracy: float
    validation_ci95: tuple[float, float]
    most_sure: float


@torch.no_grad()
def calibrate_model(
    deployed: Deployed, learnt: LearningSet, fold: Fold, samples: Samples
) -> Calibration:
    """Set a classifier's temperature and what is known to it, in place."""
    train, held = torch.from_numpy(learnt.train), torch.from_numpy(fold.validation)
    network = deployed.network
    seen, unseen = (
        torch.cat(
            [deployed.last_features(learnt.values[part]) for part in torch.split(index, _BATCH)]
        )
        for index in (train, held)
    )
    of_scores = network.novelty_of_scores
    known, held_out = (network.scores_of(f) if of_scores else f for f in (seen, unseen))
    deployed.novelty.fit(known, learnt.labels[train], held_out)
    labels = learnt.labels[held].numpy()
    recording = samples[dims.RECORDING].values[fold.validation]
    n = len(np.unique(recording))
    most_shown = most_that_can_show(n)
    logits = network.scores_of(unseen).double().numpy()
    temperature = fit_temperature(lambda temperature: logits / temperature, labels)
    temperature = soften(logits, temperature, most_shown)
    deployed.temperature = torch.tensor(temperature)
    probabilities = deployed.outcome(unseen)[0].double().numpy()
    stop_s = samples[dims.STOP].values[fold.validation]
    per_s, right_when_sure = best_evidence(probabilities, labels, recording, stop_s)
    accuracy = float((probabilities.argmax(1) == labels).mean())
    interval = wilson_interval(accuracy, n)
    most_sure = min(right_when_sure, interval[1], most_shown)
    return Calibration(temperature, per_s, accuracy, interval, most_sure)


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


def most_that_can_show(n: int) -> float:
    """Return how often a model is right that was right of n recordings of n.

    The median under a uniform prior: it is as likely too high as too low.
    """
    return float(0.5 ** (1 / (n + 1)))


def soften(logits: Floats, temperature: float, most: float) -> float:
    """Return the temperature, or the lowest at which the likeliest has `most` in the mean.

    Where all of a few samples are right, the fitted temperature is as low as it may be, and
    probabilities are 100%.
    """

    def above(log_temperature: float) -> float:
        probabilities = softmax(logits / math.exp(log_temperature), axis=1)
        return float(probabilities.max(axis=1).mean()) - most

    least = math.log(temperature)
    if above(least) <= 0:
        return temperature
    return math.exp(brentq(above, least, least + _FARTHEST))


def wilson_interval(share: float, n: int) -> tuple[float, float]:
    """Return the 95% interval of a share of n recordings (Wilson, 1927)."""
    z = 1.96
    middle, spread = share + z**2 / (2 * n), share * (1 - share) / n + (z / (2 * n)) ** 2
    low, high = ((middle + way * z * math.sqrt(spread)) / (1 + z**2 / n) for way in (-1, 1))
    return max(0.0, low), min(1.0, high)


def best_evidence(
    probabilities: Floats, labels: Indices, recording: NDArray[Any], stop_s: Floats
) -> tuple[float, float]:
    """Return how many samples' worth of evidence a second is, and how often it is right when sure.

    The first is that under which the true textures are most likely at any time. The second
    is the share of samples at which the texture that has 95% of the evidence is the true one (see
    `EvidenceAccumulator`); 1 where none has.

    Parameters
    ----------
    probabilities, labels, recording, stop_s
        Of samples not learnt from, recording by recording in the order of time.
    """
    steps_s = np.diff(stop_s)[recording[1:] == recording[:-1]]
    stride_s = float(np.median(steps_s)) if len(steps_s) else 1.0
    logs = np.empty_like(probabilities)
    for name in np.unique(recording):
        evidence = EvidenceAccumulator(probabilities.shape[1], per_s=1.0)
        for k in np.flatnonzero(recording == name):
            evidence.add(float(stop_s[k]), probabilities[k], stride_s)
            logs[k] = evidence.logs
    losses = [cross_entropy(per_s * logs, labels) for per_s in _EVIDENCE_PER_S]
    per_s = float(_EVIDENCE_PER_S[np.argmin(losses)])
    joint = softmax(per_s * logs, axis=1)
    sure = joint.max(axis=1) >= SURE
    right = joint.argmax(axis=1) == labels
    return per_s, float(right[sure].mean()) if sure.any() else 1.0

"""What one fold learns from: one tensor of values, index arrays into it, and a scale."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.protocol import Protocol
from afferents.core.samples import Samples, labels_of
from afferents.encodings import COPIES, Encoding
from afferents.evaluation import Fold
from afferents.training import TrainingConfig

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class LearningSet:
    """Values and labels, which of them train and validate, and what they are divided by.

    `values` holds all samples in their order, and after them the stretched copies if the
    family is augmented. `scaled_on` are the samples that `scale` was taken from.
    """

    values: torch.Tensor
    labels: torch.Tensor
    train: Indices
    validation: Indices
    scale: float
    scaled_on: Indices


def learning_set(
    samples: Samples,
    encoding: Encoding,
    augmented: bool,
    protocol: Protocol,
    fold: Fold,
    config: TrainingConfig,
    rng: np.random.Generator,
) -> LearningSet:
    """Gather what a fold learns from, without copying the samples.

    Parameters
    ----------
    encoding
        That made the samples.
    augmented
        Whether stretched copies stand in for speeds never seen.
    config
        Says how many samples are used at most.
    rng
        Draws the factors of the stretched copies, once a fold as published.
    """
    train = thinned(fold.train, originals(augmented, protocol, config.training_samples))
    validation = thinned(fold.validation, config.validation_samples)
    scale, scaled_on = scale_of(samples, encoding, protocol, train)
    labels = labels_of(samples)
    values = encoding.seen(samples.values)
    if augmented:
        copies, origin = encoding.stretched(samples.values[train], rng, protocol.stretch)
        added = np.arange(len(values), len(values) + len(copies))
        values = np.concatenate([values, copies])
        labels = np.concatenate([labels, labels[train][origin]])
        train = np.concatenate([train, added]) if protocol.keep_originals else added
    return LearningSet(
        torch.from_numpy(np.ascontiguousarray(values)),
        torch.from_numpy(labels),
        train,
        validation,
        scale,
        scaled_on,
    )


def originals(augmented: bool, protocol: Protocol, kept: int | None) -> int | None:
    """Return how many samples are stretched so that `kept` come out; None for all."""
    if kept is None or not augmented:
        return kept
    return max(1, kept // (len(COPIES) + protocol.keep_originals))


def scale_of(
    samples: Samples, encoding: Encoding, protocol: Protocol, train: Indices
) -> tuple[float, Indices]:
    """Return what the values are divided by, and the samples it was taken from.

    Spectra are divided by their largest amplitude, over all bins kept; SA-I and RA-I enter the
    networks in px, as published.
    """
    if not encoding.scaled:
        return 1.0, np.empty(0, dtype=np.int64)
    everything = np.arange(samples.sizes[dims.SAMPLE])
    scaled_on = everything if protocol.scale_from == "everything" else train
    return float(samples.values[scaled_on].max()) or 1.0, scaled_on


def thinned(index: Indices, kept: int | None) -> Indices:
    """Keep at most `kept` samples, evenly spread over recordings and time.

    Samples stand recording by recording, each in the order of time, so even steps through the
    index take an equal share of every recording.
    """
    if kept is None or kept >= len(index):
        return index
    steps = (np.arange(kept) + 0.5) * len(index) / kept
    spread: Indices = index[steps.astype(np.int64)]
    return spread

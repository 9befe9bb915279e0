"""What one fold learns from: one tensor of values, index arrays into it, and a scale."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from afferents import dims
from afferents.encodings.samples import Samples, find_labels
from afferents.folds.protocol import Fold, Indices, Protocol
from afferents.models.config import TrainingConfig


def gather(values: Tensor, index: Tensor, scale: float) -> Tensor:
    """Return a scaled copy of some samples."""
    return values.index_select(0, index).mul_(1 / scale)


def split(order: Tensor, batch_size: int) -> list[Tensor]:
    """Cut indices into batches; the last keeps the rest, and one left alone joins the one before.

    Batch normalisation has no variance of a single sample.
    """
    batches = list(torch.split(order, batch_size))
    if len(batches) > 1 and len(batches[-1]) == 1:
        batches[-2:] = [torch.cat(batches[-2:])]
    return batches


@dataclass(frozen=True)
class LearningSet:
    """What a network learns from.

    Attributes
    ----------
    values
        All samples in their order, float32 (n, *sample_shape); after them the stretched copies,
        if there are any.
    labels
        Number of each one's texture, int64 (n,).
    train, validation
        Samples to learn from and to evaluate by, (n_train,) and (n_validation,).
    scale
        A batch is divided by it; 1 for raw units.
    scaled_on
        Samples that the scale was taken from.
    """

    values: Tensor
    labels: Tensor
    train: Indices
    validation: Indices
    scale: float = 1.0
    scaled_on: Indices = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def on(self, device: torch.device) -> "LearningSet":
        """Return it on a device: a GPU holds all samples, on the CPU nothing is copied."""
        return replace(self, values=self.values.to(device), labels=self.labels.to(device))

    def batch(self, index: Tensor) -> tuple[Tensor, Tensor]:
        """Return the samples, scaled, and the labels of an index tensor, where they lie."""
        return gather(self.values, index, self.scale), self.labels.index_select(0, index)


def learning_set(
    samples: Samples,
    encoding: Any,
    stretched: bool,
    protocol: Protocol,
    fold: Fold,
    config: TrainingConfig,
    rng: np.random.Generator,
) -> LearningSet:
    """Gather what a fold learns from, without copying the samples.

    Parameters
    ----------
    encoding
        That made the samples; see `encodings.base.Encoding`.
    stretched
        Whether stretched copies stand in for speeds never seen.
    config
        Sets how many samples are used at most.
    rng
        Draws the factors of the stretched copies, once a fold as published.
    """
    kept = config.training_samples
    if kept is not None and stretched and encoding.n_copies:  # of which copies are made
        kept = max(1, kept // (encoding.n_copies + protocol.keep_originals))
    train = thin(fold.train, kept)
    validation = thin(fold.validation, config.validation_samples)
    scale, scaled_on = choose_scale(samples, encoding, protocol, train)
    labels = find_labels(samples)
    values = encoding.seen(samples.values)
    if stretched:
        copies, origin = encoding.stretched(samples, train, rng, protocol.stretch)
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


def choose_scale(
    samples: Samples, encoding: Any, protocol: Protocol, train: Indices
) -> tuple[float, Indices]:
    """Return what the values are divided by, and the samples it was taken from.

    Spectra are divided by their largest amplitude, over all bins kept; SA-I and RA-I enter the
    networks in px, as published.
    """
    if not encoding.scaled:
        return 1.0, np.empty(0, dtype=np.int64)
    everything = np.arange(samples.sizes[dims.SAMPLE])
    if dims.VARIANT in samples.coords:  # what is tested corrupted is a copy
        everything = np.flatnonzero(samples[dims.VARIANT].values == 0)
    scaled_on = everything if protocol.scale_from == "everything" else train
    return float(samples.values[scaled_on].max()) or 1.0, scaled_on


def thin(index: Indices, kept: int | None) -> Indices:
    """Keep at most `kept` samples, evenly spread over recordings and time.

    Samples stand recording by recording, each in the order of time, so even steps through the
    index take an equal share of every recording.
    """
    if kept is None or kept >= len(index):
        return index
    steps = (np.arange(kept) + 0.5) * len(index) / kept
    spread: Indices = index[steps.astype(np.int64)]
    return spread

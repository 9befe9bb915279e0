"""What one fold learns from: one tensor of values, index arrays into it, and a scale."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.families import Family
from afferents.core.protocol import Protocol
from afferents.core.recording import natural_order
from afferents.core.samples import Samples
from afferents.encodings import stretched_copies
from afferents.evaluation import Fold, number_in_recording

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


def textures_of(samples: Samples) -> list[str]:
    """Return the textures in natural order, which is the order of the classes."""
    return sorted({str(t) for t in np.unique(samples[dims.TEXTURE].values)}, key=natural_order)


def learning_set(
    samples: Samples,
    family: Family,
    protocol: Protocol,
    fold: Fold,
    model_bins: int,
    samples_per_recording: int | None,
    rng: np.random.Generator,
) -> LearningSet:
    """Gather what a fold learns from, without copying the samples.

    Parameters
    ----------
    model_bins
        Frequency bins that the network sees.
    samples_per_recording
        Training and validation samples kept of each recording, evenly spaced; None for all.
    rng
        Draws the factors of the stretched copies, once a fold as published.
    """
    recordings = samples[dims.RECORDING].values
    train = thinned(fold.train, recordings, samples_per_recording)
    validation = thinned(fold.validation, recordings, samples_per_recording)
    scale, scaled_on = scale_of(samples, family, protocol, train)
    classes = {texture: i for i, texture in enumerate(textures_of(samples))}
    labels = np.array([classes[str(t)] for t in samples[dims.TEXTURE].values])
    values = samples.values
    if family.encoding == "spectral":
        values = values[..., :model_bins]
    if family.augmented:
        spectra = samples.values[train]
        copies, origin = stretched_copies(spectra, rng, protocol.stretch, values.shape[-1])
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


def scale_of(
    samples: Samples, family: Family, protocol: Protocol, train: Indices
) -> tuple[float, Indices]:
    """Return what the values are divided by, and the samples it was taken from.

    Spectra are divided by their largest amplitude, over all bins kept; SA-I and RA-I enter the
    networks in px, as published (discrepancy 22).
    """
    if family.encoding != "spectral":
        return 1.0, np.empty(0, dtype=np.int64)
    everything = np.arange(samples.sizes[dims.SAMPLE])
    scaled_on = everything if protocol.scale_from == "everything" else train
    return float(samples.values[scaled_on].max()) or 1.0, scaled_on


def thinned(index: Indices, recordings: NDArray[np.str_], kept: int | None) -> Indices:
    """Keep at most `kept` samples of each recording, evenly spaced in time.

    Parameters
    ----------
    index
        Samples to choose from.
    recordings
        The recording of every sample; `index` points into it.
    """
    if kept is None:
        return index
    number = number_in_recording(recordings[index])
    _, inverse, count = np.unique(recordings[index], return_inverse=True, return_counts=True)
    share = np.minimum(kept / count[inverse], 1.0)
    # Sample n stands for the stretch from n to n + 1; those are kept in which share * n steps up.
    chosen: NDArray[np.bool_] = np.floor((number + 1) * share + 1e-9) > np.floor(
        number * share + 1e-9
    )
    kept_index: Indices = index[chosen]
    return kept_index

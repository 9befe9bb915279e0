"""What is given to a fit, and what comes of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples, textures_of
from afferents.folds.protocol import Fold, Indices
from afferents.models.base import Classifier, Network, Task, build_for
from afferents.models.classifiers import classifier_of
from afferents.models.model import Model

Check = Callable[[int, Indices], None]
"""Told, of one of a model's sources, which samples scale or weights are taken from, before they
are; raises if it must not be so."""


class Part(NamedTuple):
    """Samples of one source, which of them a fold uses, and the encoding that made them."""

    samples: Samples
    fold: Fold
    encoding: Any


@dataclass(frozen=True)
class Fitted:
    """What a fold gave.

    Attributes
    ----------
    classifier
        That has learnt.
    probabilities
        Of the textures, (test sample, texture).
    speed_mm_s
        Speeds predicted for the test samples; None where the model does not need them, or is given
        them.
    facts
        For the fold's record.
    """

    classifier: Classifier
    probabilities: NDArray[np.float32]
    speed_mm_s: NDArray[np.float64] | None
    facts: dict[str, Any]


def solved_facts(fold: Fold, n_train: int, validation_accuracy: float) -> dict[str, Any]:
    """Return what stands in the record of a fold that was learnt without epochs."""
    return {
        fold.split.validation: fold.validated_by,
        "validation_accuracy": validation_accuracy,
        "n_train": n_train,
        "n_validation": len(fold.validation),
        "n_test": len(fold.test),
        "epochs": 0,
        "passes": n_train,
        "torch": torch.__version__,
    }


def new_classifier(
    model: Model,
    samples: Samples,
    encoding: Any,
    sample_shape: tuple[int, ...],
    seed: int = 0,
    n_classes: int | None = None,
) -> Classifier:
    """Return a model's classifier for such samples, nothing learnt yet; see `build_for`.

    Parameters
    ----------
    n_classes
        None for the textures of the samples.
    """
    task = Task(
        len(textures_of(samples)) if n_classes is None else n_classes,
        tuple(sample_shape),
        tuple(map(str, samples.dims[1:])),
        encoding,
        samples[dims.FREQUENCY].values if dims.FREQUENCY in samples.coords else None,
        model.speed_from,
        seed,
    )
    return build_for(classifier_of(model.classifier), task)


def require_buildable(model: Model, samples: Samples, encoding: Any) -> None:
    """Refuse samples that a model's network is not made for; nothing of one's own is tried.

    Parameters
    ----------
    samples
        Of any recording.

    Raises
    ------
    InputError
        Saying what the network needs.
    """
    if isinstance(model.classifier, str) and issubclass(classifier_of(model.classifier), Network):
        shape = encoding.seen(samples.values[:1]).shape[1:]
        new_classifier(model, samples, encoding, shape, n_classes=2)

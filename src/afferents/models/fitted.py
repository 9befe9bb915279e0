"""What is given to a fit, and what comes of it."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples, list_textures
from afferents.errors import LeakageError
from afferents.folds.protocol import Fold, Indices, Protocol
from afferents.models import base, classifiers, learner
from afferents.models.config import TrainingConfig
from afferents.models.model import Model

Check = Callable[[int, Indices], None]
"""Is given the number of one of a model's sources, and the samples that scale or weights are about
to be taken from; raises if it must not be so."""


class Part(NamedTuple):
    """Samples of one source, which of them a fold uses, and the encoding that made them."""

    samples: Samples
    fold: Fold
    encoding: Any

    def seen(self) -> "Part":
        """Return it with what a model sees of the samples: of spectra fewer bins than are kept."""
        n = self.encoding.seen(self.samples.values[:1]).shape[-1]
        return self._replace(samples=self.samples[..., :n])


@dataclass(frozen=True)
class Fitting:
    """What learns on a fold, and from what.

    Attributes
    ----------
    parts
        Of each of the model's sources.
    config
        Of a network's training.
    rank
        Of the fold among its protocol's: stretched copies are drawn anew for each.
    check
        See `Check`.
    checkpoint
        Where a long training writes its checkpoints.
    searched
        Whether all penalties of what is solved at once are chosen inside the fold.
    """

    model: Model
    parts: Sequence[Part]
    protocol: Protocol
    config: TrainingConfig
    seed: int
    rank: int
    check: Check
    checkpoint: learner.Checkpoint | None = None
    searched: bool = False


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
    predict
        Returns the probabilities of some samples, by their indices, anew; None of what joins
        several models' samples.
    """

    classifier: base.Classifier
    probabilities: NDArray[np.float32]
    speed_mm_s: NDArray[np.float64] | None
    facts: dict[str, Any]
    predict: Callable[[Indices], NDArray[np.floating]] | None = None


ALONE = 24
"""Test samples that a model predicts again, each alone."""
_OFF = 0.1
"""Probabilities may differ by this share of what they differ by from sample to sample: a network
multiplies a single one in another order."""
_ROUNDING = 1e-4
"""And by this in any case: samples may all be alike to a model, as silence is."""


def predict_alone(name: str, fitted: Fitted, test: Indices) -> dict[str, float]:
    """Let a model predict test samples one at a time, and return how long that takes.

    Its prediction of a sample must not depend on what else is tested: a model that goes by the
    samples tested together has learnt from them.

    Parameters
    ----------
    name
        Of the model.
    test
        Of the fold.

    Returns
    -------
    `prediction_ms`, the median; nothing where it can't predict alone.

    Raises
    ------
    LeakageError
        If it mostly predicts otherwise than it did for all together.
    """
    if fitted.predict is None:
        return {}
    places = np.unique(np.linspace(0, len(test) - 1, ALONE).round().astype(int))
    off, spent = [], []
    for place in places.tolist():
        start = time.perf_counter()
        alone = fitted.predict(test[place : place + 1])
        spent.append(time.perf_counter() - start)
        off.append(float(np.abs(alone - fitted.probabilities[place]).max()))
    if np.median(off) > max(_ROUNDING, _OFF * fitted.probabilities.std(axis=0).max()):
        raise LeakageError(
            f"{name}: expected the same probabilities of a test sample whatever else is tested, "
            f"found some that differ by {np.median(off):.2g} (median) when each is alone: it goes "
            "by the samples tested, which are to be unseen"
        )
    return {"prediction_ms": round(1000 * float(np.median(spent)), 3)}


def new_classifier(
    model: Model,
    samples: Samples,
    encoding: Any,
    sample_shape: tuple[int, ...],
    seed: int = 0,
    n_classes: int | None = None,
) -> base.Classifier:
    """Return a model's classifier for such samples, nothing learnt yet; see `build_classifier`.

    Parameters
    ----------
    n_classes
        None for the textures of the samples.
    """
    task = base.Task(
        len(list_textures(samples)) if n_classes is None else n_classes,
        tuple(sample_shape),
        tuple(map(str, samples.dims[1:])),
        encoding,
        samples[dims.FREQUENCY].values if dims.FREQUENCY in samples.coords else None,
        model.speed_from,
        seed,
    )
    return base.build_classifier(classifiers.get_classifier(model.classifier), task)

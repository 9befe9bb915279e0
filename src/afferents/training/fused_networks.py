"""Networks of several afferents together: each trained alone, or one network with a stem for each.

Ours, made of the paper's own networks. Windows of vibration set when a decision is made; images
count for the window that they end in.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax

from afferents.core import dims
from afferents.core.protocol import Protocol
from afferents.core.samples import Samples, labels_of
from afferents.models import MeanFusion
from afferents.training.config import TrainingConfig
from afferents.training.fitted import Fitted, Part
from afferents.training.learning_set import scale_of, thinned
from afferents.training.pairs import last_within, mean_within

Indices = NDArray[np.int64]
_LEAST = 1e-12
"""Probabilities below are as good as 0."""


def mean_of(fitted: dict[str, Fitted], parts: Sequence[Part]) -> Fitted:
    """Return what networks say together that have each learnt alone.

    The mean of their log-probabilities, that of a part's samples first taken over each window; a
    part with no sample in a window says nothing of it. Nothing is weighed: a network has learnt
    from all training speeds, so there is none that could say how much each should count.

    Parameters
    ----------
    fitted
        By name of the part's model, in the order of `parts`.
    """
    lead = parts[0]
    labels = labels_of(lead.samples)[lead.fold.test]
    logs = []
    for one, part in zip(fitted.values(), parts, strict=True):
        own = np.log(np.maximum(one.probabilities.astype(np.float64), _LEAST))
        if part is not lead:
            own = mean_within(lead.samples, lead.fold.test, part.samples, part.fold.test, own)
        logs.append(own)
    fused = np.exp(log_softmax(np.mean(logs, axis=0), axis=1)).astype(np.float32)
    first = next(iter(fitted.values()))
    summed = ("passes", "seconds", "job_seconds")
    facts = {
        **first.facts,
        **{name: sum(one.facts[name] for one in fitted.values()) for name in summed},
        "parts": {
            name: {
                "accuracy": float((own.argmax(axis=1) == labels).mean()),
                "best_epoch": one.facts["best_epoch"],
                "validation_accuracy": one.facts["validation_accuracy"],
            }
            for (name, one), own in zip(fitted.items(), logs, strict=True)
        },
    }
    fusion = MeanFusion({n: one.classifier for n, one in fitted.items()}, [1.0] * len(fitted))
    return Fitted(fusion, fused, None, facts)


@dataclass(frozen=True)
class Stems:
    """How the samples of several afferents stand in one row of values; stands for an encoding.

    Attributes
    ----------
    shapes
        Of a sample of each.
    """

    shapes: tuple[tuple[int, ...], ...]
    scaled: ClassVar[bool] = False
    n_copies: ClassVar[int] = 0

    def seen(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return all values."""
        return values


def in_a_row(
    parts: Sequence[Part],
    protocol: Protocol,
    config: TrainingConfig,
    check: Callable[[Sequence[Indices]], None],
) -> Part:
    """Return the first part's samples, each with that of every other part that ends last in it.

    Each part is scaled as its encoding asks, by what is learnt from.
    """
    lead, shapes, rows = parts[0], [], []
    for number, part in enumerate(parts):
        train = thinned(part.fold.train, config.training_samples)
        scale, scaled_on = scale_of(part.samples, part.encoding, protocol, train)
        check([scaled_on if i == number else scaled_on[:0] for i in range(len(parts))])
        values = part.encoding.seen(part.samples.values)
        if part is not lead:
            values = values[last_within(lead.samples, part.samples)]
        shapes.append(tuple(values.shape[1:]))
        rows.append(values.reshape(len(values), -1) / np.float32(scale))
    there = lead.samples.coords
    coords = {name: there[name] for name in there if there[name].dims == (dims.SAMPLE,)}
    joined = np.concatenate(rows, axis=1)
    samples = Samples(joined, dims=(dims.SAMPLE, dims.FEATURE), coords=coords)
    return Part(samples, lead.fold, Stems(tuple(shapes)))

"""Models that are solved at once: what they learn on a fold, and what they say of its test."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.families import FAMILIES, Family
from afferents.core.samples import Samples, labels_of, textures_of
from afferents.encodings import Encodings
from afferents.evaluation import Fold, best_weights, least_surprise, surprise, weighted
from afferents.models import (
    KERNEL_STRENGTHS,
    STRENGTH,
    OrderSearch,
    Ridge,
    equal_weights,
    log_probabilities,
)
from afferents.pipeline.pairs import mean_within

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_BATCH = 256


@dataclass(frozen=True)
class Solved:
    """What a fold gave.

    Attributes
    ----------
    model
        Weights of all its parts.
    probabilities
        Of the textures, (test sample, texture).
    speed_mm_s
        What the test samples' speeds were taken for; None where the model does not ask, or is told.
    learnt_from
        Samples that anything was learnt from, for each source.
    facts
        For the fold's record.
    """

    model: nn.Module
    probabilities: NDArray[np.float32]
    speed_mm_s: Floats | None
    learnt_from: list[Indices]
    facts: dict[str, Any]


@dataclass(frozen=True)
class Learnt:
    """One model that has learnt from a fold: once without each of its speeds, then from all.

    Attributes
    ----------
    learnt_from
        Samples that it has learnt from.
    unseen
        Their log-probabilities, from the model that had not learnt from their speed.
    tested
        Log-probabilities of the test's samples.
    """

    model: Ridge | OrderSearch
    learnt_from: Indices
    unseen: Floats
    tested: Floats


def solve(
    family: Family,
    samples: Sequence[Samples],
    folds: Sequence[Fold],
    how: Encodings,
    seed: int,
    nested: bool,
) -> Solved:
    """Learn on a fold what a family is, and say what its test samples are.

    Parameters
    ----------
    samples, folds
        Of each of the family's sources.
    how
        How the samples were made.
    seed
        Of whatever is drawn.
    nested
        Whether the validation speed is a training speed, and is learnt from as the others are.
        Nothing is stopped or picked here: what temperatures and weights need to know of unseen
        speeds is had by leaving out each of the training speeds in turn. Under `published` it is
        half of the held-out speed, and is not touched.
    """
    lead, fold = samples[0], folds[0]
    if family.learner == "late fusion":
        parts = [FAMILIES[name] for name in family.parts]
        learnt = [
            _learnt(part, s, f, how, seed, nested)
            for part, s, f in zip(parts, samples, folds, strict=True)
        ]
        fused, accuracy, facts = _fused(learnt, samples, folds, family.parts)
        model: nn.Module = nn.ModuleDict(
            {name: one.model for name, one in zip(family.parts, learnt, strict=True)}
        )
    else:
        if family.learner == "joint fusion":
            lead = _joined(samples)
        one = _learnt(family, lead, fold, how, seed, nested)
        learnt, fused, facts, model = [one], one.tested, {}, one.model
        accuracy = _accuracy(one.unseen, labels_of(lead)[one.learnt_from])
    facts |= {
        "validation_mm_s": fold.validation_mm_s,
        "validation_accuracy": accuracy,
        "n_train": len(learnt[0].learnt_from),
        "n_validation": len(fold.validation),
        "n_test": len(fold.test),
        "epochs": 0,
        "passes": len(learnt[0].learnt_from),
        "torch": torch.__version__,
    }
    learnt_from = [one.learnt_from for one in learnt]
    learnt_from += [learnt_from[0][:0]] * (len(samples) - len(learnt_from))
    speed = _speeds(learnt[0].model, lead, fold.test, fused.argmax(axis=1))
    return Solved(model, np.exp(fused).astype(np.float32), speed, learnt_from, facts)


def _learnt(
    family: Family, samples: Samples, fold: Fold, how: Encodings, seed: int, nested: bool
) -> Learnt:
    """Learn one model.

    Each of its speeds is left out in turn: that sets the temperature, and of random kernels the
    penalty.
    """
    model, labels = model_of(family, samples, how), labels_of(samples)
    learnt_from = np.sort(np.concatenate([fold.train, fold.validation])) if nested else fold.train
    strengths = KERNEL_STRENGTHS if family.encoding == "kernels" else (STRENGTH,)
    tried = [_unseen(model, samples, labels, learnt_from, seed, s) for s in strengths]
    surprises = [surprise(logs, labels[learnt_from]) for _, logs in tried]
    best = int(np.argmin(surprises))
    temperature, unseen = tried[best]
    learn(model, samples, labels, learnt_from, seed, strengths[best])
    model.temperature = torch.tensor(temperature)
    tested = _at_temperature(scores_of(model, samples, fold.test), temperature)
    return Learnt(model, learnt_from, unseen, tested)


def _unseen(
    model: Ridge | OrderSearch,
    samples: Samples,
    labels: Indices,
    learnt_from: Indices,
    seed: int,
    strength: float,
) -> tuple[float, Floats]:
    """Return a temperature, and log-probabilities of samples learnt without their own speed."""
    speed = samples[dims.SPEED].values[learnt_from]
    if len(np.unique(speed)) < 2:
        raise InputError(
            "the data", "at least 2 speeds to learn from, as each is left out in its turn", "1",
            "use more speeds, or a model of Table 1",
        )  # fmt: skip
    scores: list[tuple[Indices, Tensor]] = []
    for left_out in np.unique(speed):
        its = np.flatnonzero(speed == left_out)
        learn(model, samples, labels, np.delete(learnt_from, its), seed, strength)
        scores.append((its, scores_of(model, samples, learnt_from[its])))

    def unseen_at(temperature: float) -> Floats:
        logs = np.empty((len(learnt_from), len(textures_of(samples))))
        for its, of_speed in scores:
            logs[its] = _at_temperature(of_speed, temperature)
        return logs

    temperature = least_surprise(unseen_at, labels[learnt_from])
    return temperature, unseen_at(temperature)


def model_of(family: Family, samples: Samples, how: Encodings) -> Ridge | OrderSearch:
    """Return the model of a family that is no late fusion, nothing learnt yet."""
    n_classes = len(textures_of(samples))
    if family.learner != "orders":
        return Ridge(n_classes, samples.shape[1:])
    n_features = samples.sizes[dims.FEATURE]
    return OrderSearch(
        n_classes,
        1 if n_features == 1 else n_features // 3,
        samples[dims.FREQUENCY].values,
        how.of(family.encoding).per_mm,  # type: ignore[attr-defined]
        family.speed_from,
    )


def learn(
    model: Ridge | OrderSearch,
    samples: Samples,
    labels: Indices,
    index: Indices,
    seed: int,
    strength: float,
) -> None:
    """Let a model learn from some samples, in place.

    `seed` is of what it draws, `strength` of a ridge's penalty.
    """
    values, named = torch.from_numpy(samples.values[index]), torch.from_numpy(labels[index])
    speed = torch.from_numpy(samples[dims.SPEED].values[index])
    weight = equal_weights(named, speed)
    if isinstance(model, OrderSearch):
        model.learn(values, named, weight, speed, np.random.default_rng(seed))
    else:
        model.learn(values, named, weight, strength)


def scores_of(model: Ridge | OrderSearch, samples: Samples, index: Indices) -> Tensor:
    """Return a model's scores of some samples, told their speeds; it may not ask for them."""
    speed = samples[dims.SPEED].values
    parts = [index[i : i + _BATCH] for i in range(0, len(index), _BATCH)]
    return torch.cat([
        model.scores(torch.from_numpy(samples.values[p]), torch.from_numpy(speed[p])) for p in parts
    ])  # fmt: skip


def _at_temperature(scores: Tensor, temperature: float) -> Floats:
    """Return the log-probabilities that scores mean at a temperature, (n, n_classes)."""
    return np.asarray(log_probabilities(scores.double(), temperature).numpy())


def _fused(
    learnt: Sequence[Learnt],
    samples: Sequence[Samples],
    folds: Sequence[Fold],
    names: Sequence[str],
) -> tuple[Floats, float, dict[str, Any]]:
    """Join log-probabilities by the weights that suit speeds not learnt from best.

    Returns those of the test, the accuracy at speeds not learnt from, and facts of the parts. The
    first part's windows set when a decision is made; another part's samples count for the
    window that they end in, by the mean of their log-probabilities.
    """
    lead, fold = samples[0], folds[0]
    unseen, tested = [learnt[0].unseen], [learnt[0].tested]
    windows = learnt[0].learnt_from
    for one, other, of in zip(learnt[1:], samples[1:], folds[1:], strict=True):
        unseen.append(mean_within(lead, windows, other, one.learnt_from, one.unseen))
        tested.append(mean_within(lead, fold.test, other, of.test, one.tested))
    labels = labels_of(lead)
    weights = best_weights(unseen, labels[windows])
    contributions = {
        name: {"weight": float(w), "accuracy": _accuracy(logs, labels[fold.test])}
        for name, w, logs in zip(names, weights, tested, strict=True)
    }
    accuracy = _accuracy(weighted(unseen, weights), labels[windows])
    return weighted(tested, weights), accuracy, {"parts": contributions}


def _joined(samples: Sequence[Samples]) -> Samples:
    """Return samples of the first kind with the mean of the others' values in their windows."""
    lead, *others = samples
    everything = np.arange(len(lead))
    columns = [lead.values.reshape(len(lead), -1)]
    for other in others:
        flat = other.values.reshape(len(other), -1).astype(np.float64)
        columns.append(mean_within(lead, everything, other, np.arange(len(other)), flat))
    joined = np.concatenate(columns, axis=1).astype(np.float32)
    coords = {name: lead[name] for name in dims.SAMPLE_COORDS}
    return Samples(joined, dims=(dims.SAMPLE, dims.FEATURE), coords=coords)


def _speeds(
    model: Ridge | OrderSearch, samples: Samples, index: Indices, textures: Indices
) -> Floats | None:
    """Return what a model that asks takes the speeds for, given the textures it was told."""
    if not isinstance(model, OrderSearch) or model.speed_from == "robot":
        return None
    named = torch.from_numpy(textures)
    parts = [slice(i, i + _BATCH) for i in range(0, len(index), _BATCH)]
    felt = [model.speed(torch.from_numpy(samples.values[index[p]]), named[p]) for p in parts]
    return np.asarray(torch.cat(felt).double().numpy())


def _accuracy(logs: Floats, labels: Indices) -> float:
    return float((logs.argmax(axis=1) == labels).mean())

"""Fitting solved models on a fold, and fusions of their decisions.

Beside that, what a discriminant takes samples of groups not learnt from for. It is quick, since
every group's sums are made once; nothing is chosen on the data that are asked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.encodings.samples import Samples, labels_of, speeds_told, textures_of
from afferents.errors import AfferentsError, InputError
from afferents.folds.held_out import SPEED, Split
from afferents.folds.protocol import Fold, Indices, Protocol
from afferents.models.base import Classifier, FitData, Solved
from afferents.models.classifiers import classifier_of
from afferents.models.confidence import best_weights, cross_entropy, fit_temperature, weighted
from afferents.models.fitted import Fitted, Fitting, Part, new_classifier, solved_facts
from afferents.models.learning_set import mean_within
from afferents.models.model import MODELS, Model
from afferents.models.solved import (
    Gram,
    LateFusion,
    Rows,
    equal_weights,
    log_probabilities,
    sum_of,
    sums,
)

SHRINKAGE = 0.1
"""Of the discriminant's covariance; see `models.solved.Discriminant`.

Fixed after 0.001 to 10 had been tried at held-out speeds of one simulated session.
"""

Sums = NDArray[np.float32]


def predict_left_out(
    values: Sums, labels: Indices, groups: Indices, sharing: NDArray[np.bool_]
) -> Indices:
    """Return the textures (n,) that discriminants name which have not learnt from a sample's group.

    Parameters
    ----------
    values
        (n, feature).
    labels, groups
        Numbers of textures and of groups, such as speeds, (n,).
    sharing
        Which groups (of all, in order) are not learnt from where each is left out.
    """
    x, n_classes = torch.from_numpy(values), int(labels.max()) + 1
    at = [np.flatnonzero(groups == group) for group in np.unique(groups)]
    of_group = [_sums(x[index], torch.from_numpy(labels[index]), n_classes, len(x)) for index in at]
    found = np.empty(len(values), np.int64)
    for index, without in zip(at, sharing, strict=True):
        learnt = sum_of([its for its, no in zip(of_group, without, strict=True) if not no])
        weight, constant = learnt.solve_as_discriminant(SHRINKAGE)
        found[index] = (x[index] @ weight + constant).argmax(1).numpy()
    return found


def _sums(x: torch.Tensor, labels: torch.Tensor, n_classes: int, n_samples: int) -> Gram | Rows:
    """Return the sums of one group's samples, in which every texture counts the same."""
    weight = equal_weights(labels, torch.zeros(len(labels)))
    return sums(x, nn.functional.one_hot(labels, n_classes), weight, n_samples)


# Classifiers that are solved at once: what they learn on a fold, and what they say of its test.

Floats = NDArray[np.float64]

_BATCH = 256


@dataclass(frozen=True)
class Learnt:
    """One model that has learnt from a fold: once without each of its groups, then from all.

    Attributes
    ----------
    learnt_from
        Samples that it has learnt from.
    unseen
        Their log-probabilities, from the model that had not learnt from their group.
    tested
        Log-probabilities of the test's samples.
    accuracy
        Of the unseen ones.
    penalty
        That was taken.
    """

    classifier: Solved
    learnt_from: Indices
    unseen: Floats
    tested: Floats
    accuracy: float
    penalty: float


def fit_solved(task: Fitting) -> Fitted:
    """Learn on a fold what a model is, and say what its test samples are.

    Under a nested protocol the validation group is a training group, and is learnt from as the
    others are. Nothing is stopped or picked here: what temperatures and weights need to know of
    unseen groups is had by leaving out each of the training groups in turn. Under `published` it is
    half of the group held out, and is not touched.
    """
    model, parts = task.model, [part.seen() for part in task.parts]
    learnt_from = [_learnt_from(part.fold, task.protocol) for part in parts]
    kind = classifier_of(model.classifier)
    if kind is LateFusion:
        for number, index in enumerate(learnt_from):
            task.check(number, index)
        rows = [MODELS[name] for name in model.parts]
        each = zip(rows, parts, learnt_from, strict=True)
        learnt = [_learnt(*one, task.seed, task.searched) for one in each]
        fused, accuracy, classifier, facts = _fused(learnt, parts, model.parts)
        lead, ask = parts[0], None
    else:
        task.check(0, learnt_from[0])
        lead = parts[0]
        one = _learnt(model, lead, learnt_from[0], task.seed, task.searched)
        learnt, fused, classifier = [one], one.tested, one.classifier
        facts = {"penalty": one.penalty}
        accuracy, ask = one.accuracy, partial(_probabilities, one.classifier, lead.samples)
    if not np.isfinite(fused).all():
        found = "some that are infinite or no numbers"
        raise AfferentsError(
            f"{model.name}: expected log-probabilities of the test samples, found {found}; look at "
            "the samples with afferents.samples"
        )
    facts |= solved_facts(lead.fold, len(learnt[0].learnt_from), accuracy)
    speed = _speeds(learnt[0].classifier, lead.samples, lead.fold.test, fused.argmax(axis=1))
    return Fitted(classifier, np.exp(fused).astype(np.float32), speed, facts, ask)


def _probabilities(classifier: Solved, samples: Samples, index: Indices) -> Floats:
    scores = scores_of(classifier, samples, index)
    return np.exp(_at_temperature(scores, float(classifier.temperature)))


def _learnt_from(fold: Fold, protocol: Protocol) -> Indices:
    if not protocol.solved_models_learn_from_validation:
        return fold.train
    return np.sort(np.concatenate([fold.train, fold.validation]))


def _learnt(model: Model, part: Part, learnt_from: Indices, seed: int, searched: bool) -> Learnt:
    """Learn one model.

    Each of its groups is left out in turn: that sets the temperature, and where there are several
    penalties to choose from, the penalty.
    """
    samples, labels = part.samples, labels_of(part.samples)
    classifier = new_solved(model, samples, part.encoding)
    penalties = classifier.penalties
    if searched and len(penalties) == 1:
        penalties = classifier.searched or penalties
    penalty, temperature, unseen = pick_penalty(classifier, part, learnt_from, seed, penalties)
    learn(classifier, samples, labels, learnt_from, seed, penalty, part.fold.split)
    classifier.temperature = torch.tensor(temperature)
    tested = _at_temperature(scores_of(classifier, samples, part.fold.test), temperature)
    accuracy = _accuracy(unseen, labels[learnt_from])
    return Learnt(classifier, learnt_from, unseen, tested, accuracy, penalty)


def new_solved(model: Model, samples: Samples, encoding: Any) -> Solved:
    """Return a model's classifier for such samples, nothing learnt yet."""
    classifier = new_classifier(model, samples, encoding, samples.shape[1:])
    assert isinstance(classifier, Solved)
    classifier.told_speed = model.speed_from == "robot"
    return classifier


def pick_penalty(
    classifier: Solved, part: Part, learnt_from: Indices, seed: int, penalties: Sequence[float]
) -> tuple[float, float, Floats]:
    """Return the penalty under which groups left out in turn are foretold best.

    Beside it the temperature, and log-probabilities of the samples learnt without their own group.
    """
    samples, split = part.samples, part.fold.split
    labels, n_textures = labels_of(samples), len(textures_of(samples))
    group, many = split.of(samples)[learnt_from], split.many
    if len(np.unique(group)) < 2:
        raise InputError(
            f"the data: expected at least 2 {many} to learn from, as each is left out in its "
            f"turn, found 1; use more {many}, or a model of Table 1"
        )
    learn_without = _leaving_out(classifier, samples, labels, learnt_from, seed, split)
    scores: dict[float, list[tuple[Indices, Tensor]]] = {penalty: [] for penalty in penalties}
    for left_out in np.unique(group):
        its, gone = np.flatnonzero(group == left_out), split.sharing(group, left_out)
        if gone.all():
            expected = f"{many} that share neither with any that is left out in its turn"
            found = f"none for {split.printed(left_out)}"
            raise InputError(
                f"the data: expected {expected}, found {found}; use more, or a model of Table 1"
            )
        learn_with = learn_without(gone)
        for penalty, of_groups in scores.items():
            learn_with(penalty)
            of_groups.append((its, scores_of(classifier, samples, learnt_from[its])))
    named = labels[learnt_from]
    tried = [(one, *_calibrated(found, named, n_textures)) for one, found in scores.items()]
    return min(tried, key=lambda one: cross_entropy(one[2], named))


def _leaving_out(
    classifier: Solved,
    samples: Samples,
    labels: Indices,
    index: Indices,
    seed: int,
    split: Split,
) -> Callable[[NDArray[np.bool_]], Callable[[float], None]]:
    """Return what takes some of the samples away, and gives what learns the rest with a penalty.

    What it learns from is gathered once for all penalties, and where that adds up, what is gone is
    taken from all.
    """
    everything = whole = None
    if classifier.adds_up:
        everything = _data_of(samples, labels, index, split)
        whole = classifier.gathered(everything)

    def learn_without(gone: NDArray[np.bool_]) -> Callable[[float], None]:
        if everything is None or not isinstance(whole, Gram):
            learnt = classifier.gathered(_data_of(samples, labels, index[~gone], split))
        else:
            its = FitData(*(one[torch.from_numpy(gone)] for one in everything))
            learnt = whole - classifier.gathered(its, len(index))
        return lambda penalty: classifier.solve(learnt, np.random.default_rng(seed), penalty)

    return learn_without


def _calibrated(
    scores: Sequence[tuple[Indices, Tensor]], named: Indices, n_textures: int
) -> tuple[float, Floats]:
    """Return the temperature that suits scores of samples best, and log-probabilities at it."""

    def at(temperature: float) -> Floats:
        logs = np.empty((len(named), n_textures))
        for its, of_group in scores:
            logs[its] = _at_temperature(of_group, temperature)
        return logs

    temperature = fit_temperature(at, named)
    return temperature, at(temperature)


def learn(
    classifier: Solved,
    samples: Samples,
    labels: Indices,
    index: Indices,
    seed: int,
    penalty: float,
    split: Split = SPEED,
) -> None:
    """Let a classifier learn from some samples, in place; `seed` is of what it draws.

    Every texture counts the same in each group of the split.
    """
    data = classifier.gathered(_data_of(samples, labels, index, split))
    classifier.solve(data, np.random.default_rng(seed), penalty)


def _data_of(samples: Samples, labels: Indices, index: Indices, split: Split) -> FitData:
    values, named = torch.from_numpy(samples.values[index]), torch.from_numpy(labels[index])
    speed = torch.from_numpy(speeds_told(samples)[index])
    _, group = np.unique(split.of(samples)[index], return_inverse=True)
    return FitData(values, named, equal_weights(named, torch.from_numpy(group)), speed)


def scores_of(classifier: Solved, samples: Samples, index: Indices) -> Tensor:
    """Return a model's scores of some samples, and their speeds to one that is told by a robot."""
    values, speed_mm_s = samples.values, speeds_told(samples)
    found = []
    for part in np.split(index, range(_BATCH, len(index), _BATCH)):
        told = torch.from_numpy(speed_mm_s[part]) if classifier.told_speed else None
        found.append(classifier.scores(torch.from_numpy(values[part]), told))
    return torch.cat(found)


def _at_temperature(scores: Tensor, temperature: float) -> Floats:
    """Return the log-probabilities that scores mean at a temperature, (n, n_classes)."""
    return np.asarray(log_probabilities(scores.double(), temperature).numpy())


def _fused(
    learnt: Sequence[Learnt], parts: Sequence[Part], names: Sequence[str]
) -> tuple[Floats, float, Classifier, dict[str, Any]]:
    """Join log-probabilities by the weights that suit groups not learnt from best.

    Returns those of the test, the accuracy in groups not learnt from, the fusion, and facts of its
    parts. The first part's windows set when a decision is made; another part's samples count for
    the window that they end in, by the mean of their log-probabilities.
    """
    lead, fold = parts[0].samples, parts[0].fold
    unseen, tested = [learnt[0].unseen], [learnt[0].tested]
    windows = learnt[0].learnt_from
    for one, other in zip(learnt[1:], parts[1:], strict=True):
        unseen.append(mean_within(lead, windows, other.samples, one.learnt_from, one.unseen))
        tested.append(mean_within(lead, fold.test, other.samples, other.fold.test, one.tested))
    labels = labels_of(lead)
    weights = best_weights(unseen, labels[windows])
    contributions = {
        name: {
            "weight": float(w),
            "accuracy": _accuracy(logs, labels[fold.test]),
            "penalty": one.penalty,
        }
        for name, w, logs, one in zip(names, weights, tested, learnt, strict=True)
    }
    accuracy = _accuracy(weighted(unseen, weights), labels[windows])
    by_name: dict[str, Classifier] = {
        name: one.classifier for name, one in zip(names, learnt, strict=True)
    }
    fusion = LateFusion(by_name, weights.tolist())
    return weighted(tested, weights), accuracy, fusion, {"parts": contributions}


def _speeds(
    classifier: Solved, samples: Samples, index: Indices, textures: Indices
) -> Floats | None:
    """Return what a classifier that asks takes the speeds for, given the textures it named."""
    named = torch.from_numpy(textures)
    parts = [slice(i, i + _BATCH) for i in range(0, len(index), _BATCH)]
    felt = [classifier.speed(torch.from_numpy(samples.values[index[p]]), named[p]) for p in parts]
    known = [speed for speed in felt if speed is not None]
    return np.asarray(torch.cat(known).double().numpy()) if known else None


def _accuracy(logs: Floats, labels: Indices) -> float:
    return float((logs.argmax(axis=1) == labels).mean())

"""Fitting what is solved at once on a fold: solved models, late fusions of them, and estimators."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from afferents.encodings.samples import Samples, find_labels, list_textures, speeds_told
from afferents.errors import AfferentsError, InputError
from afferents.folds.held_out import SPEED, Split
from afferents.folds.protocol import Fold, Indices
from afferents.models import calibrate, classifiers, fusion, solved
from afferents.models.base import Classifier, FitData, Solved
from afferents.models.fitted import Fitted, Fitting, Part, new_classifier
from afferents.models.model import MODELS, Model

Floats = NDArray[np.float64]

_BATCH = 256


class Learnt(NamedTuple):
    """One model that has learnt from a fold: once without each of its groups, then from all.

    Attributes
    ----------
    unseen
        Log-probabilities of the samples learnt from, each from the model that had not learnt from
        its group.
    tested
        Log-probabilities of the test's samples.
    penalty
        That was taken.
    """

    classifier: Solved
    unseen: Floats
    tested: Floats
    penalty: float


def fit_solved(task: Fitting) -> Fitted:
    """Learn on a fold what a model is, and predict its test samples.

    Under a nested protocol the validation group is a training group, and is learnt from as the
    others are. Nothing is stopped or picked here: what temperatures and weights need to know of
    unseen groups comes from leaving out each of the training groups in turn. Under `published` it
    is half of the group held out, and is not touched.
    """
    model, parts = task.model, [part.seen() for part in task.parts]
    learnt_from = []
    for number, part in enumerate(parts):
        index = part.fold.train
        if task.protocol.solved_models_learn_from_validation:
            index = np.sort(np.concatenate([index, part.fold.validation]))
        task.check(number, index)
        learnt_from.append(index)
    is_fusion = classifiers.get_classifier(model.classifier) is fusion.LateFusion
    rows = [MODELS[name] for name in model.parts] if is_fusion else [model]
    each = zip(rows, parts, learnt_from, strict=True)
    learnt = [_learn_part(*one, task.seed, task.searched) for one in each]
    lead, first = parts[0], learnt[0]
    if is_fusion:
        tested, accuracy, classifier, facts = _fuse(learnt, parts, learnt_from, model.parts)
    else:
        tested, classifier, facts = first.tested, first.classifier, {"penalty": first.penalty}
        accuracy = _accuracy(first.unseen, find_labels(lead.samples)[learnt_from[0]])
    if not np.isfinite(tested).all():
        raise AfferentsError(
            f"{model.name}: expected log-probabilities of the test samples, found some that are "
            "infinite or no numbers; look at the samples with afferents.samples"
        )

    def predict_again(index: Indices) -> Floats:
        scores = score(first.classifier, lead.samples, index)
        return np.exp(_logs(scores, float(first.classifier.temperature)))

    facts |= _describe_fold(lead.fold, len(learnt_from[0]), accuracy)
    speed = _predict_speeds(first.classifier, lead, tested.argmax(axis=1))
    probabilities = np.exp(tested).astype(np.float32)
    again = None if is_fusion else predict_again
    return Fitted(classifier, probabilities, speed, facts, again)


def fit_estimator(task: Fitting) -> Fitted:
    """Let a user's scikit-learn estimator learn from a fold, and predict its test samples.

    Nothing is picked by the validation samples: its accuracy on them is for the record alone.
    """
    samples, fold, encoding = task.parts[0].seen()
    task.check(0, fold.train)
    labels, estimator = find_labels(samples), new_solved(task.model, samples, encoding)
    learn(estimator, samples, labels, fold.train, task.seed, 0.0, fold.split)
    accuracy = _accuracy(
        score(estimator, samples, fold.validation).numpy(), labels[fold.validation]
    )

    def predict_again(index: Indices) -> NDArray[np.float32]:
        found: NDArray[np.float32] = score(estimator, samples, index).exp().float().numpy()
        return found

    facts = _describe_fold(fold, len(fold.train), accuracy)
    return Fitted(estimator, predict_again(fold.test), None, facts, predict_again)


def _describe_fold(fold: Fold, n_train: int, validation_accuracy: float) -> dict[str, Any]:
    """Return the record of a fold that was learnt without epochs."""
    return {
        "validated_by": fold.validated_by,
        "validation_accuracy": validation_accuracy,
        "n_train": n_train,
        "n_validation": len(fold.validation),
        "n_test": len(fold.test),
        "epochs": 0,
        "passes": n_train,
        "torch": torch.__version__,
    }


def _learn_part(model: Model, part: Part, index: Indices, seed: int, searched: bool) -> Learnt:
    """Learn one model.

    Each of its groups is left out in turn: that sets the temperature, and where there are several
    penalties to choose from, the penalty.
    """
    samples, fold = part.samples, part.fold
    classifier = new_solved(model, samples, part.encoding)
    penalties = classifier.penalties
    if searched and len(penalties) == 1:
        penalties = classifier.searched or penalties
    penalty, temperature, unseen = pick_penalty(classifier, part, index, seed, penalties)
    learn(classifier, samples, find_labels(samples), index, seed, penalty, fold.split)
    classifier.temperature = torch.tensor(temperature)
    tested = _logs(score(classifier, samples, fold.test), temperature)
    return Learnt(classifier, unseen, tested, penalty)


def new_solved(model: Model, samples: Samples, encoding: Any) -> Solved:
    """Return a model's classifier for such samples, nothing learnt yet."""
    classifier = new_classifier(model, samples, encoding, samples.shape[1:])
    assert isinstance(classifier, Solved)
    return classifier


def pick_penalty(
    classifier: Solved, part: Part, learnt_from: Indices, seed: int, penalties: Sequence[float]
) -> tuple[float, float, Floats]:
    """Return the penalty under which groups left out in turn are predicted best.

    Also the temperature, and log-probabilities of the samples learnt without their own group. What
    it learns from is gathered once for all penalties, and where that adds up, the group left out is
    taken from the sums of all.
    """
    samples, split = part.samples, part.fold.split
    labels, n_textures = find_labels(samples), len(list_textures(samples))
    group, many = split.of(samples)[learnt_from], split.many
    if len(np.unique(group)) < 2:
        raise InputError(
            f"the data: expected at least 2 {many} to learn from, as each is left out in its "
            f"turn, found 1; use more {many}, or a model of Table 1"
        )
    whole = None
    if classifier.adds_up:
        everything = _gather(samples, labels, learnt_from, split)
        whole = classifier.gathered(everything)
    scores: dict[float, list[tuple[Indices, Tensor]]] = {penalty: [] for penalty in penalties}
    for left_out in np.unique(group):
        its, gone = np.flatnonzero(group == left_out), split.sharing(group, left_out)
        if gone.all():
            expected = f"{many} that share neither with any that is left out in its turn"
            found = f"none for {split.printed(left_out)}"
            raise InputError(
                f"the data: expected {expected}, found {found}; use more, or a model of Table 1"
            )
        if isinstance(whole, solved.Gram):
            taken = FitData(*(one[torch.from_numpy(gone)] for one in everything))
            kept = whole - classifier.gathered(taken, len(learnt_from))
        else:
            kept = classifier.gathered(_gather(samples, labels, learnt_from[~gone], split))
        for penalty, of_groups in scores.items():
            classifier.solve(kept, np.random.default_rng(seed), penalty)
            of_groups.append((its, score(classifier, samples, learnt_from[its])))
    named = labels[learnt_from]
    tried = [(one, *_calibrate(found, named, n_textures)) for one, found in scores.items()]
    return min(tried, key=lambda one: calibrate.cross_entropy(one[2], named))


def _calibrate(
    scores: Sequence[tuple[Indices, Tensor]], named: Indices, n_textures: int
) -> tuple[float, Floats]:
    """Return the temperature that suits scores of samples best, and log-probabilities at it."""

    def logs_at(temperature: float) -> Floats:
        logs = np.empty((len(named), n_textures))
        for its, of_group in scores:
            logs[its] = _logs(of_group, temperature)
        return logs

    temperature = calibrate.fit_temperature(logs_at, named)
    return temperature, logs_at(temperature)


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
    data = classifier.gathered(_gather(samples, labels, index, split))
    classifier.solve(data, np.random.default_rng(seed), penalty)


def _gather(samples: Samples, labels: Indices, index: Indices, split: Split) -> FitData:
    values, named = torch.from_numpy(samples.values[index]), torch.from_numpy(labels[index])
    speed = torch.from_numpy(speeds_told(samples)[index])
    _, group = np.unique(split.of(samples)[index], return_inverse=True)
    return FitData(values, named, solved.equal_weights(named, torch.from_numpy(group)), speed)


def score(classifier: Solved, samples: Samples, index: Indices) -> Tensor:
    """Return a model's scores of some samples; one that a robot tells the speed is given it."""
    values, speed_mm_s = samples.values, speeds_told(samples)
    found = []
    for part in np.split(index, range(_BATCH, len(index), _BATCH)):
        told = torch.from_numpy(speed_mm_s[part]) if classifier.told_speed else None
        found.append(classifier.scores(torch.from_numpy(values[part]), told))
    return torch.cat(found)


def _logs(scores: Tensor, temperature: float) -> Floats:
    """Return the log-probabilities that scores mean at a temperature, (n, n_classes)."""
    return np.asarray(solved.log_probabilities(scores.double(), temperature).numpy())


def _fuse(
    learnt: Sequence[Learnt],
    parts: Sequence[Part],
    learnt_from: Sequence[Indices],
    names: Sequence[str],
) -> tuple[Floats, float, Classifier, dict[str, Any]]:
    """Join log-probabilities by the weights that suit groups not learnt from best.

    Returns those of the test, the accuracy in groups not learnt from, the fusion, and facts of its
    parts. The first part's windows set when a decision is made; another part's samples count for
    the window that they end in, by the mean of their log-probabilities.
    """
    lead, fold, windows = parts[0].samples, parts[0].fold, learnt_from[0]
    unseen, tested = [learnt[0].unseen], [learnt[0].tested]
    for one, index, part in zip(learnt[1:], learnt_from[1:], parts[1:], strict=True):
        other = part.samples
        unseen.append(fusion.mean_within(lead, windows, other, index, one.unseen))
        tested.append(fusion.mean_within(lead, fold.test, other, part.fold.test, one.tested))
    labels = find_labels(lead)
    weights = fusion.best_weights(unseen, labels[windows])
    contributions = {
        name: {
            "weight": float(weight),
            "accuracy": _accuracy(logs, labels[fold.test]),
            "penalty": one.penalty,
        }
        for name, weight, logs, one in zip(names, weights, tested, learnt, strict=True)
    }
    accuracy = _accuracy(fusion.join(unseen, weights), labels[windows])
    by_name: dict[str, Classifier] = dict(
        zip(names, (one.classifier for one in learnt), strict=True)
    )
    fused = fusion.LateFusion(by_name, weights.tolist())
    return fusion.join(tested, weights), accuracy, fused, {"parts": contributions}


def _predict_speeds(classifier: Solved, part: Part, textures: Indices) -> Floats | None:
    """Return the test samples' speeds, mm/s, given the textures named; None if it needs none."""
    values, found = part.samples.values, []
    batches = range(_BATCH, len(textures), _BATCH)
    for index, named in zip(
        np.split(part.fold.test, batches), np.split(textures, batches), strict=True
    ):
        speed = classifier.speed(torch.from_numpy(values[index]), torch.from_numpy(named))
        if speed is None:
            return None
        found.append(speed)
    return np.asarray(torch.cat(found).double().numpy())


def _accuracy(scores: NDArray[np.floating], labels: Indices) -> float:
    return float((scores.argmax(axis=1) == labels).mean())

"""Fitting a model on a fold, whatever its classifier is."""

import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.model import MODELS, Model
from afferents.core.protocol import PROTOCOLS, Protocol
from afferents.core.samples import labels_of
from afferents.models import (
    Classifier,
    CnnLstm,
    LateFusion,
    MeanFusion,
    Network,
    Solved,
    classifier_of,
)
from afferents.models.own import OwnEstimator
from afferents.training.checkpoint import Checkpoint
from afferents.training.config import TrainingConfig
from afferents.training.estimator import fit_estimator
from afferents.training.fitted import Fitted, Part, new_classifier
from afferents.training.fused_networks import in_a_row, mean_of
from afferents.training.hardware import computed_with
from afferents.training.learning_set import LearningSet, learning_set
from afferents.training.loop import TrainedModel, predict, train
from afferents.training.solved import fit_solved, learn, new_solved
from afferents.training.staged import train_in_stages

Indices = NDArray[np.int64]


def recipe_of(model: Model, encoding: object) -> str:
    """Return the name of the recipe that a model's network is trained by.

    The model's own, else its classifier's, else that of the paper's network for such samples.
    """
    kind = classifier_of(model.classifier)
    usual = "vibration-net" if getattr(encoding, "of_vibration", False) else "spatial-net"
    return model.recipe or getattr(kind, "recipe", "") or usual


def recipes_of(model: Model, parts: Sequence[Part]) -> list[str]:
    """Return the recipe of a model's network; of networks that learn apart, that of each."""
    alone = model.parts if classifier_of(model.classifier).learns_parts else ()
    rows = [MODELS[name] for name in alone] or [model]
    return [recipe_of(row, part.encoding) for row, part in zip(rows, parts, strict=False)]


def fit(
    model: Model,
    parts: Sequence[Part],
    protocol: Protocol,
    configs: Sequence[TrainingConfig],
    seed: int,
    rank: int,
    check: Callable[[Sequence[Indices]], None],
    checkpoint: Checkpoint | None = None,
    searched: bool = False,
) -> Fitted:
    """Learn on a fold what a model is, and say what its test samples are.

    Parameters
    ----------
    parts
        Of each of the model's sources.
    configs
        Of a network's training, for each of the model's parts; one where it has none.
    rank
        Of the fold among its protocol's: stretched copies are drawn anew for each.
    check
        Told, for each source, which samples scale or weights are taken from, before they are.
    checkpoint
        Where a long training writes its checkpoints.
    searched
        Whether all penalties of what is solved at once are chosen inside the fold.

    Raises
    ------
    AfferentsError
        If the training fails; of a classifier of a user's own, whatever it raises.
    """
    kind, config = classifier_of(model.classifier), configs[0]
    if issubclass(kind, MeanFusion):
        return _fit_each(model, parts, protocol, configs, seed, rank, check)
    if issubclass(kind, Network):
        rng = np.random.default_rng([seed, rank])
        nothing = [part.fold.train[:0] for part in parts[1:]]
        joined = in_a_row(parts, protocol, config, check) if nothing else parts[0]
        told = partial(_with, check, 0, len(parts))
        return _fit_network(model, joined, protocol, config, seed, rng, told, checkpoint)
    if issubclass(kind, OwnEstimator):
        return fit_estimator(model, parts[0], seed, check)
    if issubclass(kind, Solved | LateFusion):
        return fit_solved(model, parts, protocol.name == "nested", seed, check, searched)
    raise InputError("classifier", "a Network or a Solved one", kind.__name__)


def _fit_each(
    model: Model,
    parts: Sequence[Part],
    protocol: Protocol,
    configs: Sequence[TrainingConfig],
    seed: int,
    rank: int,
    check: Callable[[Sequence[Indices]], None],
) -> Fitted:
    """Train the network of each part alone; a training that is cut off begins anew."""
    fitted = {}
    each = zip(model.parts, parts, configs, strict=True)
    for number, (name, part, config) in enumerate(each):
        rng = np.random.default_rng([seed, rank])
        told = partial(_with, check, number, len(parts))
        fitted[name] = _fit_network(
            MODELS[name], part, protocol, config, seed, rng, told, checkpoint=None
        )
    return mean_of(fitted, parts)


def _with(
    check: Callable[[Sequence[Indices]], None], number: int, n: int, learnt: Sequence[Indices]
) -> None:
    """Tell a check what one of several sources is scaled on, and nothing of the others."""
    check([learnt[0] if i == number else learnt[0][:0] for i in range(n)])


def learns_in_a_loop(model: Model) -> bool:
    """Tell whether a model is a network, that presets of training are for."""
    return issubclass(classifier_of(model.classifier), Network)


def fit_once(
    model: Model, part: Part, config: TrainingConfig, seed: int
) -> tuple[Classifier, LearningSet]:
    """Learn from a fold's training samples; return the classifier and what it learnt from."""
    if learns_in_a_loop(model):
        rng, nested = np.random.default_rng(seed), PROTOCOLS["nested"]
        learnt = learning_set(
            part.samples, part.encoding, model.stretched, nested, part.fold, config, rng
        )
        network = _new_network(model, part, learnt, seed)
        fit_network(network, learnt, config, seed)
        return network, learnt
    solved, labels = new_solved(model, part.samples, part.encoding), labels_of(part.samples)
    fold, penalty = part.fold, solved.penalties[0]
    learn(solved, part.samples, labels, fold.train, seed, penalty, fold.split)
    values = torch.from_numpy(part.samples.values)
    numbers = torch.from_numpy(labels)
    return solved, LearningSet(values, numbers, part.fold.train, part.fold.validation)


def _fit_network(
    model: Model,
    part: Part,
    protocol: Protocol,
    config: TrainingConfig,
    seed: int,
    rng: np.random.Generator,
    check: Callable[[Sequence[Indices]], None],
    checkpoint: Checkpoint | None,
) -> Fitted:
    start = time.perf_counter()
    fold = part.fold
    learnt = learning_set(part.samples, part.encoding, model.stretched, protocol, fold, config, rng)
    check([learnt.scaled_on])
    network = _new_network(model, part, learnt, seed)
    trained = fit_network(network, learnt, config, seed, checkpoint)
    earlier_s = max(0.0, trained.seconds - (time.perf_counter() - start))  # before it was stopped
    probabilities = predict(network, learnt.values, fold.test, learnt.scale, config)
    facts = {
        fold.split.validation: fold.validated_by,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(fold.test),
        "scale": learnt.scale,
        **trained.facts(),
        **computed_with(config),
        "job_seconds": round(time.perf_counter() - start + earlier_s, 3),
    }
    return Fitted(network, probabilities, None, facts)


def _new_network(model: Model, part: Part, learnt: LearningSet, seed: int) -> Classifier:
    shape = tuple(learnt.values.shape[1:])
    return new_classifier(model, part.samples, part.encoding, shape, seed)


def fit_network(
    network: Classifier,
    learnt: LearningSet,
    config: TrainingConfig,
    seed: int,
    checkpoint: Checkpoint | None = None,
) -> TrainedModel:
    """Train a network in place, in stages where the recipe says so and the network has stages."""
    if config.image_epochs and isinstance(network, CnnLstm):
        return train_in_stages(network, learnt, config, seed)
    return train(network, learnt, config, seed, checkpoint=checkpoint)

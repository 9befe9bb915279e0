"""Fitting a model on a fold, whatever its classifier is."""

import time
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import find_labels
from afferents.errors import AfferentsError, InputError, raised
from afferents.folds.protocol import PROTOCOLS, Indices
from afferents.models import fit_solved, fusion, hardware, loop
from afferents.models.base import Classifier, Network, Solved
from afferents.models.classifiers import OwnEstimator, get_classifier
from afferents.models.config import TrainingConfig
from afferents.models.fitted import Fitted, Fitting, Part, new_classifier
from afferents.models.learning_set import LearningSet, learning_set
from afferents.models.model import MODELS, Model


def choose_recipe(model: Model, encoding: object) -> str:
    """Return the name of the recipe that a model's network is trained by.

    The model's own, else its classifier's, else that of the paper's network for such samples.
    """
    kind = get_classifier(model.classifier)
    of_runs = dims.FRAME in getattr(encoding, "sample_dims", ())
    usual = "cnn-lstm" if of_runs else "spatial-net"
    if getattr(encoding, "of_vibration", False):
        usual = "vibration-net"
    return model.recipe or getattr(kind, "recipe", "") or usual


def fit(task: Fitting) -> Fitted:
    """Learn on a fold what a model is, and predict its test samples.

    Raises
    ------
    AfferentsError
        If the training fails; of a classifier of a user's own, whatever it raises.
    """
    kind = get_classifier(task.model.classifier)
    if task.model.stretched and not issubclass(kind, Network):
        raise InputError(
            f"model '{task.model.name}': expected a network, which alone learns from stretched "
            f"copies, found {kind.name}; leave out stretched"
        )
    _require_learnt(task, kind)
    if issubclass(kind, Network):
        return _fit_network(task)
    if issubclass(kind, OwnEstimator):
        return fit_solved.fit_estimator(task)
    if issubclass(kind, Solved | fusion.LateFusion):
        try:
            return fit_solved.fit_solved(task)
        except (AttributeError, TypeError, ValueError, LookupError, ArithmeticError) as error:
            if task.model.name in MODELS:
                raise
            raise AfferentsError(f"the classifier {kind.name}: {raised(error)}") from error
    raise InputError(f"classifier: expected a Network or a Solved one, found {kind.__name__}")


def _require_learnt(task: Fitting, kind: type[Classifier]) -> None:
    """Refuse to test a texture that can't have been learnt: it would only count as wrong."""
    solved = issubclass(kind, Solved | fusion.LateFusion) and not issubclass(kind, OwnEstimator)
    for part in task.parts:
        fold, texture = part.fold, part.samples[dims.TEXTURE].values
        learnt = {*texture[fold.train].tolist()}
        if solved and task.protocol.solved_models_learn_from_validation:
            learnt |= {*texture[fold.validation].tolist()}
        if never := sorted({*texture[fold.test].tolist()} - learnt):
            raise InputError(
                f"the data: expected every texture that is tested to be learnt from, found none of "
                f"{never[0]} with {fold.split.printed(fold.held_out)} held out and "
                f"{fold.split.printed(fold.validated_by)} to validate with; record it again, or "
                "leave it out with --textures"
            )


def learns_in_a_loop(model: Model) -> bool:
    """Return whether a model is a network, that presets of training are for."""
    return issubclass(get_classifier(model.classifier), Network)


def fit_once(
    model: Model, part: Part, config: TrainingConfig, seed: int, progress: Callable[[float], None]
) -> tuple[Classifier, LearningSet]:
    """Learn from a fold's training samples; return the classifier and what it learnt from.

    `progress` is called with the share of a network's training that is done.
    """
    if learns_in_a_loop(model):
        rng, nested = np.random.default_rng(seed), PROTOCOLS["nested"]
        learnt = learning_set(
            part.samples, part.encoding, model.stretched, nested, part.fold, config, rng
        )
        network = new_classifier(model, part.samples, part.encoding, learnt.values.shape[1:], seed)
        loop.train(network, learnt, config, seed, progress)
        return network, learnt
    part = part.seen()
    solved, labels = (
        fit_solved.new_solved(model, part.samples, part.encoding),
        find_labels(part.samples),
    )
    fold, (penalty, *others) = part.fold, solved.penalties
    if others and len(np.unique(fold.split.of(part.samples)[fold.train])) > 1:
        penalty, *_ = fit_solved.pick_penalty(solved, part, fold.train, seed, solved.penalties)
    fit_solved.learn(solved, part.samples, labels, fold.train, seed, penalty, fold.split)
    values = torch.from_numpy(part.samples.values)
    numbers = torch.from_numpy(labels)
    return solved, LearningSet(values, numbers, part.fold.train, part.fold.validation)


def _fit_network(task: Fitting) -> Fitted:
    start, part = time.perf_counter(), task.parts[0]
    fold, model, config, seed = part.fold, task.model, task.config, task.seed
    rng = np.random.default_rng([seed, task.rank])
    stretched, protocol = model.stretched, task.protocol
    learnt = learning_set(part.samples, part.encoding, stretched, protocol, fold, config, rng)
    task.check(0, learnt.scaled_on)
    network = new_classifier(model, part.samples, part.encoding, learnt.values.shape[1:], seed)
    history = loop.train(network, learnt, config, seed, checkpoint=task.checkpoint)
    earlier_s = max(0.0, history.seconds - (time.perf_counter() - start))  # before it was stopped

    def predict_again(index: Indices) -> NDArray[np.float32]:
        return loop.predict(network, learnt.values, index, learnt.scale, config)

    facts = {
        "validated_by": fold.validated_by,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(fold.test),
        "scale": learnt.scale,
        **history.facts(),
        **hardware.describe_computing(config),
        "job_seconds": round(time.perf_counter() - start + earlier_s, 3),
    }
    return Fitted(network, predict_again(fold.test), None, facts, predict_again)

"""Fitting a model on a fold, whatever its classifier is.

There is a shorter road for the CNN-LSTM: images first, time after. The image stack learns from
single frames, as the spatial network, and is then kept; what it makes of every frame is worked out
once, and the LSTMs and dense layers learn from that. A frame costs a tenth of a run, and the second
stage next to nothing. Not the recipe of the authors' code.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents import dims
from afferents.encodings.samples import labels_of
from afferents.errors import AfferentsError, InputError, raised
from afferents.folds.protocol import PROTOCOLS, Indices, Protocol
from afferents.models.base import Classifier, Network, Solved
from afferents.models.classifiers import OwnEstimator, build, classifier_of
from afferents.models.config import TrainingConfig
from afferents.models.fit_solved import fit_solved, learn, new_solved, pick_penalty, scores_of
from afferents.models.fitted import Fitted, Fitting, Part, new_classifier, solved_facts
from afferents.models.hardware import autocast, choose_device, computed_with
from afferents.models.learning_set import (
    LearningSet,
    learning_set,
)
from afferents.models.loop import Checkpoint, TrainedModel, predict, train
from afferents.models.model import MODELS, Model
from afferents.models.networks import CnnLstm, SpatialNet, image_features, last_state
from afferents.models.solved import LateFusion

_AT_ONCE = 64


class _Head(nn.Module):
    """The LSTMs and dense layers of a CNN-LSTM, for features (batch, frame, feature)."""

    light_dropout = CnnLstm.light_dropout

    def __init__(self, model: CnnLstm) -> None:
        super().__init__()
        self.lstm, self.dense = model.lstm, model.dense

    def forward(self, features: Tensor) -> Tensor:
        logits: Tensor = self.dense(last_state(self.lstm, features))
        return logits


def train_in_stages(
    model: CnnLstm,
    learnt: LearningSet,
    config: TrainingConfig,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> TrainedModel:
    """Train a CNN-LSTM in place, its image stack from single frames first.

    Of every training run one frame is taken, the first of the first run, the second of the
    second and so on; the image stage is trained as `config.of_images` says, on as many frames as
    there are training runs times `config.frames_a_run`.

    Parameters
    ----------
    model, learnt, config, seed, progress
        As for `train`; values are (n_runs, frame, row, column) and not scaled.
    """
    start = time.perf_counter()
    values, labels = learnt.values, learnt.labels
    n_frames = values.shape[1]
    n_classes = int(labels.max()) + 1
    spatial = cast("SpatialNet", build(SpatialNet, n_classes, tuple(values.shape[2:]), seed))
    spatial.image.load_state_dict(model.image.state_dict())
    frames = LearningSet(
        values.flatten(0, 1),
        labels.repeat_interleave(n_frames),
        _frames_of(learnt.train, n_frames, config.frames_a_run),
        _frames_of(learnt.validation, n_frames, 1),
    )
    stage = config.of_images()
    if stage.dropout == "light":  # what suits a spatial network suits a stack that goes on less
        stage = stage.model_copy(update={"dropout": model.light_dropout})
    of_images = train(spatial, frames, stage, seed, lambda share: progress(share / 2))
    model.image.load_state_dict(spatial.image.state_dict())
    used = np.concatenate([learnt.train, learnt.validation])
    features = _features(model.image, values, used, config)
    n_train = len(learnt.train)
    after = LearningSet(
        features,
        labels[torch.from_numpy(used)],
        np.arange(n_train),
        np.arange(n_train, len(used)),
    )
    trained = train(_Head(model), after, config, seed, lambda share: progress((1 + share) / 2))
    return replace(
        trained,
        model=model,
        passes=of_images.passes + trained.passes,
        seconds=time.perf_counter() - start,
    )


def _frames_of(runs: NDArray[np.int64], n_frames: int, a_run: int) -> NDArray[np.int64]:
    """Return `a_run` frames of each run, other places of other runs, as indices of frames."""
    a_run = min(a_run, n_frames)
    place = (np.arange(len(runs))[:, None] + np.arange(a_run) * (n_frames // a_run)) % n_frames
    frames: NDArray[np.int64] = (runs[:, None] * n_frames + place).ravel()
    return frames


@torch.no_grad()
def _features(
    image: nn.Module, values: Tensor, runs: NDArray[np.int64], config: TrainingConfig
) -> Tensor:
    """Return what the image stack makes of every frame of some runs, (n_runs, frame, feature)."""
    device = choose_device(config)
    image.to(device).eval()
    n_frames, *size = values.shape[1:]
    features = torch.empty(len(runs), n_frames, image_features(*size))
    indices = torch.split(torch.from_numpy(runs), _AT_ONCE)
    for part, index in zip(torch.split(features, _AT_ONCE), indices, strict=True):
        batch = values.index_select(0, index).to(device)
        with autocast(config, device):
            found = image(batch.flatten(0, 1).unsqueeze(1))
        part.copy_(found.unflatten(0, batch.shape[:2]))
    return features


# A scikit-learn estimator of a user's own on a fold.


def fit_estimator(task: Fitting) -> Fitted:
    """Let it learn from the fold's training samples, and say what the test samples are.

    Nothing is picked by the validation samples: what it says of them is for the record alone.
    """
    samples, fold, encoding = task.parts[0].seen()
    task.check(0, fold.train)
    labels, estimator = labels_of(samples), new_solved(task.model, samples, encoding)
    learn(estimator, samples, labels, fold.train, task.seed, 0.0, fold.split)
    validated = scores_of(estimator, samples, fold.validation).argmax(1).numpy()
    accuracy = float((validated == labels[fold.validation]).mean())

    def ask(index: Indices) -> NDArray[np.float32]:
        found: NDArray[np.float32] = scores_of(estimator, samples, index).exp().float().numpy()
        return found

    facts = solved_facts(fold, len(fold.train), accuracy)
    return Fitted(estimator, ask(fold.test), None, facts, ask)


# Fitting a model on a fold, whatever its classifier is.


def recipe_of(model: Model, encoding: object) -> str:
    """Return the name of the recipe that a model's network is trained by.

    The model's own, else its classifier's, else that of the paper's network for such samples.
    """
    kind = classifier_of(model.classifier)
    of_runs = dims.FRAME in getattr(encoding, "sample_dims", ())
    usual = "cnn-lstm" if of_runs else "spatial-net"
    if getattr(encoding, "of_vibration", False):
        usual = "vibration-net"
    return model.recipe or getattr(kind, "recipe", "") or usual


def fit(task: Fitting) -> Fitted:
    """Learn on a fold what a model is, and say what its test samples are.

    Raises
    ------
    AfferentsError
        If the training fails; of a classifier of a user's own, whatever it raises.
    """
    kind = classifier_of(task.model.classifier)
    if task.model.stretched and not issubclass(kind, Network):
        raise InputError(
            f"model '{task.model.name}': expected a network, which alone learns from stretched "
            f"copies, found {kind.name}; leave out stretched"
        )
    for part in task.parts:
        _require_learnt(part, task.protocol, kind)
    if issubclass(kind, Network):
        return _fit_network(task)
    if issubclass(kind, OwnEstimator):
        return fit_estimator(task)
    if issubclass(kind, Solved | LateFusion):
        try:
            return fit_solved(task)
        except (AttributeError, TypeError, ValueError, LookupError, ArithmeticError) as error:
            if task.model.name in MODELS:
                raise
            raise AfferentsError(f"the classifier {kind.name}: {raised(error)}") from error
    raise InputError(f"classifier: expected a Network or a Solved one, found {kind.__name__}")


def _require_learnt(part: Part, protocol: Protocol, kind: type[Classifier]) -> None:
    """Refuse to test a texture that can't have been learnt: it would only count as wrong."""
    fold, texture = part.fold, part.samples[dims.TEXTURE].values
    solved = issubclass(kind, Solved | LateFusion) and not issubclass(kind, OwnEstimator)
    learnt = {*texture[fold.train].tolist()}
    if solved and protocol.solved_models_learn_from_validation:
        learnt |= {*texture[fold.validation].tolist()}
    if never := sorted({*texture[fold.test].tolist()} - learnt):
        raise InputError(
            f"the data: expected every texture that is tested to be learnt from, found none of "
            f"{never[0]} with {fold.split.printed(fold.held_out)} held out and "
            f"{fold.split.printed(fold.validated_by)} to validate with; record it again, or leave "
            "it out with --textures"
        )


def learns_in_a_loop(model: Model) -> bool:
    """Tell whether a model is a network, that presets of training are for."""
    return issubclass(classifier_of(model.classifier), Network)


def fit_once(
    model: Model, part: Part, config: TrainingConfig, seed: int, progress: Callable[[float], None]
) -> tuple[Classifier, LearningSet]:
    """Learn from a fold's training samples; return the classifier and what it learnt from.

    `progress` is told which share of a network's training is done.
    """
    if learns_in_a_loop(model):
        rng, nested = np.random.default_rng(seed), PROTOCOLS["nested"]
        learnt = learning_set(
            part.samples, part.encoding, model.stretched, nested, part.fold, config, rng
        )
        network = new_classifier(model, part.samples, part.encoding, learnt.values.shape[1:], seed)
        fit_network(network, learnt, config, seed, progress)
        return network, learnt
    part = part.seen()
    solved, labels = new_solved(model, part.samples, part.encoding), labels_of(part.samples)
    fold, (penalty, *others) = part.fold, solved.penalties
    if others and len(np.unique(fold.split.of(part.samples)[fold.train])) > 1:
        penalty, *_ = pick_penalty(solved, part, fold.train, seed, solved.penalties)
    learn(solved, part.samples, labels, fold.train, seed, penalty, fold.split)
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
    trained = fit_network(network, learnt, config, seed, checkpoint=task.checkpoint)
    earlier_s = max(0.0, trained.seconds - (time.perf_counter() - start))  # before it was stopped

    def ask(index: Indices) -> NDArray[np.float32]:
        return predict(network, learnt.values, index, learnt.scale, config)

    facts = {
        "validated_by": fold.validated_by,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(fold.test),
        "scale": learnt.scale,
        **trained.facts(),
        **computed_with(config),
        "job_seconds": round(time.perf_counter() - start + earlier_s, 3),
    }
    return Fitted(network, ask(fold.test), None, facts, ask)


def fit_network(
    network: Classifier,
    learnt: LearningSet,
    config: TrainingConfig,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
    checkpoint: Checkpoint | None = None,
) -> TrainedModel:
    """Train a network in place, in stages where the recipe says so and the network has stages."""
    if config.image_epochs and isinstance(network, CnnLstm):
        return train_in_stages(network, learnt, config, seed, progress)
    return train(network, learnt, config, seed, progress, checkpoint)

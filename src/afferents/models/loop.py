"""The training loop, one for every network; a CNN-LSTM may go through it in two stages.

The data stay in the one tensor they came in, or lie whole on a GPU. Folds are arrays of indices
into it, and a batch is gathered when it is its turn.
"""

import math
import time
from collections.abc import Callable
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.errors import AfferentsError, InputError
from afferents.models import base, hardware, layers, learner, learning_set, networks
from afferents.models.config import TrainingConfig

_EVALUATION_BATCH = 256
_RUNS_AT_ONCE = 64


def train(
    model: nn.Module,
    learnt: learning_set.LearningSet,
    config: TrainingConfig,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
    checkpoint: learner.Checkpoint | None = None,
) -> learner.History:
    """Train a network in place until its validation accuracy no longer rises.

    Adam on cross-entropy plus the L2 term; training stops `patience` epochs after the best
    validation accuracy, whose weights are restored (reference: train_*.ipynb, cells 4 to 9;
    seeds set anew for each model, as there). The same seed on the same machine, in float32 on
    the CPU and with as many threads, gives the same weights.

    Deviations from Keras: Adam's eps (1e-7) is added after the bias correction of the second
    moment instead of before, as PyTorch has it; a last batch of a single sample joins the one
    before, because batch normalisation has no variance of one.

    A `CnnLstm` is trained in stages where the configuration has any; see `train_in_stages`.

    Parameters
    ----------
    model
        Network from samples to logits.
    learnt
        What it learns from; copied as a whole to a GPU alone.
    config
        See `TrainingConfig`.
    seed
        Of the order of the samples and of dropout.
    progress
        Called after every epoch with the share of them that is done, if none stops it before.
    checkpoint
        Where checkpoints are written now and then, and read from; None for nowhere. A training in
        stages has none.

    Raises
    ------
    InputError
        If there are fewer than two training samples or no validation samples, the scale is not a
        positive number, or the network has another number of dropout layers.
    AfferentsError
        If the loss is no longer a finite number.
    """
    if len(learnt.train) < 2:
        raise InputError(f"a fold: expected at least 2 training samples, found {len(learnt.train)}")
    if len(learnt.validation) < 1:
        raise InputError("a fold: expected at least 1 validation sample, found none")
    if not (math.isfinite(learnt.scale) and learnt.scale > 0):
        raise InputError(
            f"a fold: expected a positive scale, found {learnt.scale}; look for samples that are "
            "NaN or infinite"
        )
    if config.image_epochs and isinstance(model, networks.CnnLstm):
        return train_in_stages(model, learnt, config, seed, progress)
    layers.set_dropout(model, config.dropout)
    start = time.perf_counter()
    device = hardware.choose_device(config)
    hardware.use_channels_last(model.to(device))
    data = learnt.on(device)
    gpus = [torch.cuda.current_device()] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=gpus):  # the caller's random state is left as it was
        torch.manual_seed(seed)
        training, validation = (
            torch.tensor(index, dtype=torch.int64, device=device)
            for index in (learnt.train, learnt.validation)
        )
        steps = len(learning_set.split(training, config.batch_size))
        n_epochs = config.epochs(len(training))
        learns = learner.Learner(model, config, device, n_epochs * steps)
        about = {
            "of": checkpoint.of if checkpoint else "",
            "seed": seed,
            "scale": learnt.scale,
            "samples": [len(training), len(validation)],
            "config": config.model_dump(),
            **hardware.describe_computing(config),
        }
        history = checkpoint.resume(learns, about) if checkpoint else learner.History()
        for number in range(len(history.epochs) + 1, n_epochs + 1):
            started_s = time.perf_counter()
            order = training[torch.randperm(len(training)).to(device)]
            fitted = learns.learn(data, learning_set.split(order, config.batch_size))
            validated = learns.evaluate(data, torch.split(validation, _EVALUATION_BATCH))
            if not (math.isfinite(fitted[0]) and math.isfinite(validated[0])):
                raise AfferentsError(
                    f"training: the loss is no longer a number in epoch {number}; look for "
                    "samples that are NaN or infinite, or lower the learning rate"
                )
            seconds = time.perf_counter() - started_s
            history.add(learner.Epoch(number, *fitted, *validated, seconds), model)
            progress(number / n_epochs)
            if history.is_over(config.patience):
                break
            if checkpoint:
                checkpoint.save(learns, history, about)
    model.load_state_dict(history.weights)
    history.passes = len(history.epochs) * len(learnt.train)
    history.seconds += time.perf_counter() - start
    return history


@torch.inference_mode()
def predict(
    model: nn.Module,
    values: Tensor,
    index: NDArray[np.int64],
    scale: float,
    config: TrainingConfig,
) -> NDArray[np.float32]:
    """Return the probability of each texture for some of the samples.

    Parameters
    ----------
    model
        Trained network; it is left in evaluation mode.
    values, scale
        Those of a `LearningSet`.
    index
        Samples to classify, shape (n,).
    config
        For device and precision.

    Returns
    -------
    NDArray
        Shape (n, n_classes), float32, rows sum to 1.
    """
    device = hardware.choose_device(config)
    hardware.use_channels_last(model.to(device)).eval()
    parts = []
    for batch in torch.split(
        torch.tensor(index, dtype=torch.int64, device=values.device), _EVALUATION_BATCH
    ):
        with hardware.autocast(config, device):
            logits = model(learning_set.gather(values, batch, scale).to(device))
        parts.append(logits.float().softmax(1).cpu())
    return torch.cat(parts).numpy()


class _Head(nn.Module):
    """The LSTMs and dense layers of a CNN-LSTM, for features (batch, frame, feature)."""

    light_dropout = networks.CnnLstm.light_dropout

    def __init__(self, model: networks.CnnLstm) -> None:
        super().__init__()
        self.lstm, self.dense = model.lstm, model.dense

    def forward(self, features: Tensor) -> Tensor:
        logits: Tensor = self.dense(networks.last_state(self.lstm, features))
        return logits


def train_in_stages(
    model: networks.CnnLstm,
    learnt: learning_set.LearningSet,
    config: TrainingConfig,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> learner.History:
    """Train a CNN-LSTM in place: images first, time after. Not the recipe of the authors' code.

    The image stack learns from single frames, as the spatial network, and is then kept; what it
    makes of every frame is worked out once, and the LSTMs and dense layers learn from that. A frame
    costs a tenth of a run, and the second stage next to nothing.

    Of every training run one frame is taken, the first of the first run, the second of the
    second and so on; the image stage is trained by `config.of_images`, on as many frames as
    there are training runs times `config.frames_a_run`.

    Parameters
    ----------
    model, learnt, config, seed, progress
        As for `train`; values are (n_runs, frame, row, column) and not scaled.
    """
    start = time.perf_counter()
    values, labels = learnt.values, learnt.labels
    n_frames, *size = values.shape[1:]
    task = base.Task(int(labels.max()) + 1, tuple(size), networks.SpatialNet.takes, seed=seed)
    spatial = cast("networks.SpatialNet", base.build_classifier(networks.SpatialNet, task))
    spatial.image.load_state_dict(model.image.state_dict())
    frames = learning_set.LearningSet(
        values.flatten(0, 1),
        labels.repeat_interleave(n_frames),
        pick_frames(learnt.train, n_frames, config.frames_a_run),
        pick_frames(learnt.validation, n_frames, 1),
    )
    stage = config.of_images()
    if stage.dropout == "light":  # what suits a spatial network suits a stack that goes on less
        stage = stage.model_copy(update={"dropout": model.light_dropout})
    of_images = train(spatial, frames, stage, seed, lambda share: progress(share / 2))
    model.image.load_state_dict(spatial.image.state_dict())
    used = np.concatenate([learnt.train, learnt.validation])
    after = learning_set.LearningSet(
        _image_features(model.image, values, used, config),
        labels[torch.from_numpy(used)],
        np.arange(len(learnt.train)),
        np.arange(len(learnt.train), len(used)),
    )
    history = train(_Head(model), after, config, seed, lambda share: progress((1 + share) / 2))
    history.passes += of_images.passes
    history.seconds = time.perf_counter() - start
    return history


def pick_frames(runs: NDArray[np.int64], n_frames: int, a_run: int) -> NDArray[np.int64]:
    """Return `a_run` frames of each run, other places of other runs, as indices of frames."""
    a_run = min(a_run, n_frames)
    place = (np.arange(len(runs))[:, None] + np.arange(a_run) * (n_frames // a_run)) % n_frames
    frames: NDArray[np.int64] = (runs[:, None] * n_frames + place).ravel()
    return frames


@torch.no_grad()
def _image_features(
    image: nn.Module, values: Tensor, runs: NDArray[np.int64], config: TrainingConfig
) -> Tensor:
    """Return what the image stack makes of every frame of some runs, (n_runs, frame, feature)."""
    device = hardware.choose_device(config)
    image.to(device).eval()
    n_frames, *size = values.shape[1:]
    features = torch.empty(len(runs), n_frames, networks.image_features(*size))
    indices = torch.split(torch.from_numpy(runs), _RUNS_AT_ONCE)
    for part, index in zip(torch.split(features, _RUNS_AT_ONCE), indices, strict=True):
        batch = values.index_select(0, index).to(device)
        with hardware.autocast(config, device):
            found = image(batch.flatten(0, 1).unsqueeze(1))
        part.copy_(found.unflatten(0, batch.shape[:2]))
    return features

"""The training loop: one, plain, for every network.

The data stay in the one tensor they came in, or lie whole on a GPU. Folds are arrays of indices
into it, and a batch is gathered when it is its turn.
"""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.core.errors import AfferentsError, InputError
from afferents.training.checkpoint import Checkpoint
from afferents.training.config import TrainingConfig
from afferents.training.data import gather, split
from afferents.training.hardware import autocast, choose_device, computed_with, to_channels_last
from afferents.training.history import Epoch, History
from afferents.training.hyperparameters import set_dropout
from afferents.training.learner import Learner
from afferents.training.learning_set import LearningSet

EVALUATION_BATCH = 256


@dataclass(frozen=True)
class TrainedModel:
    """A network with the weights of its best epoch, and how it came to them."""

    model: nn.Module
    history: tuple[Epoch, ...]
    best_epoch: int
    """Number of the first epoch with the highest validation accuracy."""
    passes: int
    """Samples that went forward and backward, of all epochs; in stages also single frames."""
    seconds: float

    def facts(self) -> dict[str, Any]:
        """Return everything but the network, ready for JSON."""
        return {
            "epochs": len(self.history),
            "best_epoch": self.best_epoch,
            "passes": self.passes,
            "validation_accuracy": self.history[self.best_epoch - 1].validation_accuracy,
            "seconds": round(self.seconds, 3),
            "history": [asdict(epoch) for epoch in self.history],
        }


def train(
    model: nn.Module,
    learnt: LearningSet,
    config: TrainingConfig,
    seed: int,
    progress: Callable[[Epoch], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> TrainedModel:
    """Train a network in place until its validation accuracy no longer rises.

    Adam on cross-entropy plus the L2 term; training stops `patience` epochs after the best
    validation accuracy, whose weights are restored (reference: train_*.ipynb, cells 4 to 9;
    seeds set anew for each model, as there). The same seed on the same machine, in float32 on
    the CPU and with as many threads, gives the same weights.

    Deviations from Keras: Adam's eps (1e-7) is added after the bias correction of the second
    moment instead of before, as PyTorch has it; a last batch of a single sample joins the one
    before, because batch normalisation has no variance of one.

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
        Called after every epoch.
    checkpoint
        Where checkpoints are written now and then, and read from; None for nowhere.

    Raises
    ------
    InputError
        If there are fewer than two training samples or no validation samples, the scale is not a
        positive number, or the network has another number of dropout layers.
    AfferentsError
        If the loss is no longer a finite number.
    """
    _check(learnt)
    set_dropout(model, config.dropout)
    start = time.perf_counter()
    device = choose_device(config)
    to_channels_last(model.to(device))
    data = learnt.on(device)
    with _seeded(seed, device):
        training, validation = (_indices(i, device) for i in (learnt.train, learnt.validation))
        steps = len(split(training, config.batch_size))
        epochs = range(1, config.max_epochs + 1)
        learner = Learner(model, config, device, len(epochs) * steps)
        about = {
            "of": checkpoint.of if checkpoint else "",
            "seed": seed,
            "scale": learnt.scale,
            "samples": [len(training), len(validation)],
            "config": config.model_dump(),
            **computed_with(config),
        }
        history = checkpoint.resume(learner, about) if checkpoint else History()
        left = epochs[len(history.epochs) :]
        for epoch in _epochs(learner, data, training, validation, config, left):
            history.add(epoch, model)
            if progress:
                progress(epoch)
            if history.is_over(config.patience):
                break
            if checkpoint:
                checkpoint.save(learner, history, about)
    model.load_state_dict(history.weights)
    passes = len(history.epochs) * len(learnt.train)
    seconds = history.seconds + time.perf_counter() - start
    return TrainedModel(model, tuple(history.epochs), history.best_epoch, passes, seconds)


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
        As of a `LearningSet`.
    index
        Samples to classify, shape (n,).
    config
        For device and precision.

    Returns
    -------
    NDArray
        Shape (n, n_classes), float32, rows sum to 1.
    """
    device = choose_device(config)
    to_channels_last(model.to(device)).eval()
    parts = []
    for batch in torch.split(_indices(index, values.device), EVALUATION_BATCH):
        with autocast(config, device):
            logits = model(gather(values, batch, scale).to(device))
        parts.append(logits.float().softmax(1).cpu())
    return torch.cat(parts).numpy()


def _epochs(
    learner: Learner,
    data: LearningSet,
    training: Tensor,
    validation: Tensor,
    config: TrainingConfig,
    numbers: range,
) -> Iterator[Epoch]:
    """Train the epoch of the next number whenever it is asked for."""
    for number in numbers:
        start = time.perf_counter()
        order = training[torch.randperm(len(training)).to(training.device)]
        learnt = learner.learn(data, split(order, config.batch_size))
        judged = learner.evaluate(data, torch.split(validation, EVALUATION_BATCH))
        if not (math.isfinite(learnt[0]) and math.isfinite(judged[0])):
            raise AfferentsError(
                f"training: the loss is no longer a number in epoch {number}; look for samples "
                "that are NaN or infinite, or lower the learning rate"
            )
        yield Epoch(number, *learnt, *judged, time.perf_counter() - start)


def _indices(index: NDArray[np.int64], device: torch.device) -> Tensor:
    return torch.tensor(index, dtype=torch.int64, device=device)


@contextmanager
def _seeded(seed: int, device: torch.device) -> Iterator[None]:
    """Draw from `seed` inside, and leave the caller's random state as it was."""
    gpus = [torch.cuda.current_device()] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=gpus):
        torch.manual_seed(seed)
        yield


def _check(learnt: LearningSet) -> None:
    if len(learnt.train) < 2:
        raise InputError("a fold", "at least 2 training samples", f"{len(learnt.train)}")
    if len(learnt.validation) < 1:
        raise InputError("a fold", "at least 1 validation sample", "none")
    if not (math.isfinite(learnt.scale) and learnt.scale > 0):
        do = "look for samples that are NaN or infinite"
        raise InputError("a fold", "a positive scale", f"{learnt.scale}", do)

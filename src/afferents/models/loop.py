"""A network and its optimiser: one pass over batches, to learn or to evaluate."""

import json
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm
from torch.optim.lr_scheduler import OneCycleLR

from afferents.documents import parse_json
from afferents.errors import AfferentsError, InputError, then
from afferents.files import write_aside
from afferents.models.config import TrainingConfig
from afferents.models.hardware import autocast, choose_device, computed_with, to_channels_last
from afferents.models.layers import l2_penalty, set_dropout
from afferents.models.learning_set import LearningSet, gather, split


class Learner:
    """Adam on cross-entropy plus the L2 term of a network's marked kernels."""

    def __init__(
        self, model: nn.Module, config: TrainingConfig, device: torch.device, n_steps: int
    ) -> None:
        """Prepare to train `model`, which lies on `device` already, for at most so many steps."""
        self.model = model
        self.device, self.l2 = device, config.l2
        self.precision = autocast(config, device)
        trainable = [p for p in model.parameters() if p.requires_grad]
        rate = config.learning_rate
        self.optimiser = torch.optim.Adam(trainable, lr=rate, eps=1e-7, fused=True)
        self.cycle = (
            OneCycleLR(self.optimiser, rate, total_steps=n_steps + 1) if config.one_cycle else None
        )
        self.statistics = WarmUp(model) if config.warm_up_statistics else None

    def state(self) -> dict[str, Any]:
        """Return where the schedules are, ready for JSON; see `go_on`."""
        group = self.optimiser.param_groups[0]
        return {
            "rate": group["lr"],
            "betas": group["betas"],
            "cycle": self.cycle.last_epoch if self.cycle else 0,
            "steps": self.statistics.steps if self.statistics else 0,
        }

    def go_on(self, state: Mapping[str, Any]) -> None:
        """Put the schedules where they were."""
        group = self.optimiser.param_groups[0]
        group["lr"], group["betas"] = state["rate"], tuple(state["betas"])
        if self.cycle:
            self.cycle.last_epoch = state["cycle"]
        if self.statistics:
            self.statistics.steps = state["steps"]

    def learn(self, data: LearningSet, batches: Iterable[Tensor]) -> tuple[float, float]:
        """Take one step for each batch of indices; return mean loss and accuracy."""
        self.model.train()
        tally = Tally(self.device)
        for index in batches:
            if self.statistics:
                self.statistics.step()
            samples, labels = data.batch(index)
            logits, loss = self._forward(samples, labels)
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            self.optimiser.step()
            if self.cycle:
                self.cycle.step()
            tally.add(logits, loss, labels)
        if self.statistics:
            self.statistics.rest()
        return tally.means()

    @torch.no_grad()
    def evaluate(self, data: LearningSet, batches: Iterable[Tensor]) -> tuple[float, float]:
        """Return mean loss and accuracy over batches of indices, learning nothing."""
        self.model.eval()
        tally = Tally(self.device)
        for index in batches:
            samples, labels = data.batch(index)
            tally.add(*self._forward(samples, labels), labels)
        return tally.means()

    def _forward(self, samples: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits and loss; only the network itself may run in bfloat16."""
        with self.precision:
            logits = self.model(samples).float()
        return logits, F.cross_entropy(logits, labels) + l2_penalty(self.model, self.l2)


class Tally:
    """Mean loss and accuracy over samples, summed on the device so that no step waits."""

    def __init__(self, device: torch.device) -> None:
        """Start at nothing."""
        self.loss = torch.zeros((), dtype=torch.float64, device=device)
        self.correct = torch.zeros((), dtype=torch.int64, device=device)
        self.n = 0

    def add(self, logits: Tensor, loss: Tensor, labels: Tensor) -> None:
        """Count one batch, whose `loss` is its mean."""
        self.n += len(labels)
        self.loss += loss.detach() * len(labels)
        self.correct += (logits.detach().argmax(1) == labels).sum()

    def means(self) -> tuple[float, float]:
        """Return mean loss and accuracy of all samples counted."""
        return float(self.loss) / self.n, float(self.correct) / self.n


class WarmUp:
    """Batch normalisation whose running statistics start as plain averages.

    In step n the momentum is 1 / n until that falls below the layer's own, so the initial 0
    and 1 are forgotten at once and the statistics are an average of all batches so far.

    Keras has no such thing: its statistics still hold 37% of 0 and 1 after 100 steps. With the
    paper's 218 steps an epoch and more that is over in an epoch or two (the authors' logs show
    chance in the first); with a data set of 25 steps an epoch, early stopping would look at ten
    epochs of chance and give up before there is anything to see.
    """

    def __init__(self, model: nn.Module) -> None:
        """Take over the batch normalisations of `model`."""
        self.layers = [(m, m.momentum or 0.0) for m in model.modules() if isinstance(m, _BatchNorm)]
        self.steps = 0

    def step(self) -> None:
        """Set the momentum for the next batch."""
        self.steps += 1
        for layer, momentum in self.layers:
            layer.momentum = max(momentum, 1 / self.steps)

    def rest(self) -> None:
        """Give the layers their own momentum back."""
        for layer, momentum in self.layers:
            layer.momentum = momentum


# The history of a training: its epochs, the best of them, and its weights.

Weights = dict[str, Tensor]


@dataclass(frozen=True)
class Epoch:
    """What one epoch came to. Losses are cross-entropy plus the L2 term, as Keras logs them."""

    number: int
    """From 1."""
    loss: float
    accuracy: float
    """Over the epoch's training batches, with dropout, as they came."""
    validation_loss: float
    validation_accuracy: float
    seconds: float


@dataclass
class History:
    """The epochs so far.

    Attributes
    ----------
    epochs
        All epochs, in order.
    best_epoch
        Number of the first with the highest validation accuracy; 0 before the first epoch.
    weights
        Of that epoch.
    seconds
        That earlier processes have spent on it.
    """

    epochs: list[Epoch] = field(default_factory=list)
    best_epoch: int = 0
    weights: Weights = field(default_factory=dict)
    seconds: float = 0.0

    def add(self, epoch: Epoch, model: nn.Module) -> None:
        """Take in an epoch that has just ended; the model's weights are kept if it is the best."""
        self.epochs.append(epoch)
        best = self.epochs[self.best_epoch - 1].validation_accuracy
        if not self.best_epoch or epoch.validation_accuracy > best:
            self.best_epoch = epoch.number
            self.weights = {name: value.clone() for name, value in model.state_dict().items()}

    def is_over(self, patience: int | None) -> bool:
        """Tell whether `patience` epochs have gone by without a better one; never of None."""
        return patience is not None and len(self.epochs) - self.best_epoch >= patience


# Checkpoints: a training that was stopped goes on where it was, to the same weights.

EVERY_S = 300.0
"""A checkpoint is written this often, s; most trainings end before."""

_WHAT = "a checkpoint of a training"
_MODEL, _BEST, _ADAM, _RANDOM, _RANDOM_GPU = "model.", "best.", "adam.", "random", "random_gpu"


class Checkpoint:
    """The file that holds all that a training needs to go on.

    Parameters
    ----------
    path
        Safetensors: the network, the best weights, Adam's moments, and the random state; the
        rest stands in its metadata.
    of
        What tells the training from others of that path: of other data, say.
    every_s
        How often it is written, s.
    """

    def __init__(self, path: Path, of: str = "", every_s: float = EVERY_S) -> None:
        """Nothing is read or written yet."""
        self.path, self.of, self._every_s = path, of, every_s
        self._started_s = self._written_s = time.monotonic()

    def save(self, learner: Learner, history: History, about: Mapping[str, object]) -> None:
        """Write, if it is time, what is needed to go on after the epoch that has just ended."""
        if time.monotonic() - self._written_s < self._every_s:
            return
        tensors = {
            **_named(_MODEL, learner.model.state_dict()),
            **_named(_BEST, history.weights),
            **_moments(learner),
            _RANDOM: torch.get_rng_state(),
        }
        if learner.device.type == "cuda":
            tensors[_RANDOM_GPU] = torch.cuda.get_rng_state()
        rest = {
            "about": about,
            "epochs": [asdict(epoch) for epoch in history.epochs],
            "best_epoch": history.best_epoch,
            "seconds": history.seconds + time.monotonic() - self._started_s,
            "learner": learner.state(),
        }
        content = save(tensors, {name: json.dumps(value) for name, value in rest.items()})
        with write_aside(self.path) as partial:
            partial.write_bytes(content)
        self._written_s = time.monotonic()

    def resume(self, learner: Learner, about: Mapping[str, object]) -> History:
        """Put learner and random state where they were, and return the history up to there.

        A file that is damaged, or of another training than `about` says, is not heeded: the
        history is then empty.
        """
        self._started_s = time.monotonic()
        try:
            with safe_open(self.path, "pt", device=str(learner.device)) as file:
                stored = (file.metadata() or {}).items()
                rest = {name: parse_json(text, self.path, _WHAT) for name, text in stored}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (OSError, SafetensorError, InputError):
            return History()
        if rest.get("about") != json.loads(json.dumps(about)):
            return History()
        learner.model.load_state_dict(_part(_MODEL, tensors))
        _set_moments(learner, tensors)
        learner.go_on(rest["learner"])
        torch.set_rng_state(tensors[_RANDOM].cpu())
        if _RANDOM_GPU in tensors:
            torch.cuda.set_rng_state(tensors[_RANDOM_GPU].cpu())
        epochs = [Epoch(**epoch) for epoch in rest["epochs"]]
        return History(epochs, rest["best_epoch"], _part(_BEST, tensors), rest["seconds"])


def _named(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {f"{prefix}{name}": value.contiguous() for name, value in tensors.items()}


def _part(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}


def _moments(learner: Learner) -> dict[str, Tensor]:
    """Return Adam's steps and moments, by number of the parameter."""
    state = learner.optimiser.state_dict()["state"]
    return {
        f"{_ADAM}{i}.{name}": value.contiguous()
        for i, moments in state.items()
        for name, value in moments.items()
    }


def _set_moments(learner: Learner, tensors: Mapping[str, Tensor]) -> None:
    """Put Adam's steps and moments back, in the layout of their parameters."""
    for name, value in _part(_ADAM, tensors).items():
        number, _, moment = name.partition(".")
        parameter = learner.optimiser.param_groups[0]["params"][int(number)]
        if value.shape == parameter.shape:
            value = torch.empty_like(parameter).copy_(value)
        learner.optimiser.state[parameter][moment] = value


# The training loop: one, plain, for every network.
#
# The data stay in the one tensor they came in, or lie whole on a GPU. Folds are arrays of indices
# into it, and a batch is gathered when it is its turn.

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
    progress: Callable[[float], None] = lambda _: None,
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
        Told after every epoch which share of them is done, if none stops it before.
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
        epochs = range(1, config.epochs(len(training)) + 1)
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
            progress(len(history.epochs) / len(epochs))
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
        raise InputError(f"a fold: expected at least 2 training samples, found {len(learnt.train)}")
    if len(learnt.validation) < 1:
        raise InputError("a fold: expected at least 1 validation sample, found none")
    if not (math.isfinite(learnt.scale) and learnt.scale > 0):
        do = "look for samples that are NaN or infinite"
        raise InputError(f"a fold: expected a positive scale, found {learnt.scale}{then(do)}")

"""A network as it learns: a pass over batches, the history of its epochs, and its checkpoints."""

import json
import time
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
import torch.nn.functional as F  # noqa: N812
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm
from torch.optim.lr_scheduler import OneCycleLR

from afferents import documents, files
from afferents.errors import InputError
from afferents.models import hardware, layers
from afferents.models.config import TrainingConfig
from afferents.models.learning_set import LearningSet

EVERY_S = 300.0
"""A checkpoint is written this often, s; most trainings end before."""

_MODEL, _BEST, _ADAM, _RANDOM, _RANDOM_GPU = "model.", "best.", "adam.", "random", "random_gpu"


class Learner:
    """Adam on cross-entropy plus the L2 term of a network's marked kernels."""

    def __init__(
        self, model: nn.Module, config: TrainingConfig, device: torch.device, n_steps: int
    ) -> None:
        """Prepare to train `model`, which lies on `device` already, for at most `n_steps` steps."""
        self.model = model
        self.device, self.l2 = device, config.l2
        self.precision = hardware.autocast(config, device)
        trainable = [p for p in model.parameters() if p.requires_grad]
        rate = config.learning_rate
        self.optimiser = torch.optim.Adam(trainable, lr=rate, eps=1e-7, fused=True)
        self.cycle = (
            OneCycleLR(self.optimiser, rate, total_steps=n_steps + 1) if config.one_cycle else None
        )
        self.statistics = WarmUp(model) if config.warm_up_statistics else None

    def state(self) -> dict[str, Any]:
        """Return where the schedules are, ready for JSON; see `restore`."""
        group = self.optimiser.param_groups[0]
        return {
            "rate": group["lr"],
            "betas": group["betas"],
            "cycle": self.cycle.last_epoch if self.cycle else 0,
            "steps": self.statistics.steps if self.statistics else 0,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
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
            self.statistics.restore()
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
        return logits, F.cross_entropy(logits, labels) + layers.l2_penalty(self.model, self.l2)


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

    def restore(self) -> None:
        """Give the layers their own momentum back."""
        for layer, momentum in self.layers:
            layer.momentum = momentum


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
    """The epochs of a training so far, and the weights of the best.

    Attributes
    ----------
    epochs
        All epochs, in order.
    best_epoch
        Number of the first with the highest validation accuracy; 0 before the first epoch.
    weights
        Of that epoch.
    seconds
        That were spent on it, by earlier processes too.
    passes
        Samples that went forward and backward, of all epochs; in stages also single frames.
    """

    epochs: list[Epoch] = field(default_factory=list)
    best_epoch: int = 0
    weights: dict[str, Tensor] = field(default_factory=dict)
    seconds: float = 0.0
    passes: int = 0

    def add(self, epoch: Epoch, model: nn.Module) -> None:
        """Add an epoch that has just ended, and keep the model's weights if it is the best."""
        self.epochs.append(epoch)
        best = self.epochs[self.best_epoch - 1].validation_accuracy
        if not self.best_epoch or epoch.validation_accuracy > best:
            self.best_epoch = epoch.number
            self.weights = {name: value.clone() for name, value in model.state_dict().items()}

    def is_over(self, patience: int | None) -> bool:
        """Return whether `patience` epochs have passed without a better one; never for None."""
        return patience is not None and len(self.epochs) - self.best_epoch >= patience

    def facts(self) -> dict[str, Any]:
        """Return everything but the weights, ready for JSON."""
        return {
            "epochs": len(self.epochs),
            "best_epoch": self.best_epoch,
            "passes": self.passes,
            "validation_accuracy": self.epochs[self.best_epoch - 1].validation_accuracy,
            "seconds": round(self.seconds, 3),
            "history": [asdict(epoch) for epoch in self.epochs],
        }


class Checkpoint:
    """The file from which a training that was stopped resumes, to the same weights.

    Parameters
    ----------
    path
        Safetensors: the network, the best weights, Adam's moments, and the random state; the
        rest stands in its metadata.
    of
        What distinguishes the training from others of that path: of other data, say.
    every_s
        How often it is written, s.
    """

    def __init__(self, path: Path, of: str = "", every_s: float = EVERY_S) -> None:
        """Nothing is read or written yet."""
        self.path, self.of, self._every_s = path, of, every_s
        self._started_s = self._written_s = time.monotonic()

    def save(self, learner: Learner, history: History, about: Mapping[str, object]) -> None:
        """Write, if it is time, what is needed to resume after the epoch that has just ended."""
        if time.monotonic() - self._written_s < self._every_s:
            return
        adam = learner.optimiser.state_dict()["state"]
        tensors = {
            **_prefix(_MODEL, learner.model.state_dict()),
            **_prefix(_BEST, history.weights),
            **_prefix(_ADAM, {f"{i}.{k}": v for i, its in adam.items() for k, v in its.items()}),
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
        with files.write_aside(self.path) as partial:
            partial.write_bytes(content)
        self._written_s = time.monotonic()

    def resume(self, learner: Learner, about: Mapping[str, object]) -> History:
        """Put learner and random state where they were, and return the history up to there.

        A file that is damaged, or of another training than `about` describes, is ignored: the
        history is then empty.
        """
        self._started_s = time.monotonic()
        try:
            with safe_open(self.path, "pt", device=str(learner.device)) as file:
                stored = (file.metadata() or {}).items()
                what = "a checkpoint of a training"
                rest = {name: documents.parse_json(text, self.path, what) for name, text in stored}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (OSError, SafetensorError, InputError):
            return History()
        if rest.get("about") != json.loads(json.dumps(about)):
            return History()
        learner.model.load_state_dict(_select(_MODEL, tensors))
        for name, value in _select(_ADAM, tensors).items():
            number, _, moment = name.partition(".")
            parameter = learner.optimiser.param_groups[0]["params"][int(number)]
            if value.shape == parameter.shape:  # in the layout of its parameter
                value = torch.empty_like(parameter).copy_(value)
            learner.optimiser.state[parameter][moment] = value
        learner.restore(rest["learner"])
        torch.set_rng_state(tensors[_RANDOM].cpu())
        if _RANDOM_GPU in tensors:
            torch.cuda.set_rng_state(tensors[_RANDOM_GPU].cpu())
        epochs = [Epoch(**epoch) for epoch in rest["epochs"]]
        return History(epochs, rest["best_epoch"], _select(_BEST, tensors), rest["seconds"])


def _prefix(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {f"{prefix}{name}": value.contiguous() for name, value in tensors.items()}


def _select(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}

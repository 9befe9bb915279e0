"""A network and its optimiser: one pass over batches, to learn or to evaluate."""

from collections.abc import Iterable, Mapping
from typing import Any

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm
from torch.optim.lr_scheduler import OneCycleLR

from afferents.models import l2_penalty
from afferents.training.config import TrainingConfig
from afferents.training.hardware import autocast
from afferents.training.learning_set import LearningSet


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

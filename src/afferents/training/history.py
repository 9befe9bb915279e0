"""The history of a training: its epochs, the best of them, and its weights."""

from dataclasses import dataclass, field

from torch import Tensor, nn

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
        if not self.best_epoch or epoch.validation_accuracy > self._best.validation_accuracy:
            self.best_epoch = epoch.number
            self.weights = {name: value.clone() for name, value in model.state_dict().items()}

    def is_over(self, patience: int | None) -> bool:
        """Tell whether `patience` epochs have gone by without a better one; never of None."""
        return patience is not None and len(self.epochs) - self.best_epoch >= patience

    @property
    def _best(self) -> Epoch:
        return self.epochs[self.best_epoch - 1]

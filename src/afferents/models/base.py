"""What a classifier is: `Network` (trained in epochs) and `Solved` (solved at once)."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.errors import InputError
from afferents.models.model import SpeedFrom


class Task(NamedTuple):
    """What a classifier is built for.

    Attributes
    ----------
    n_classes
        Number of textures, at least 2.
    sample_shape, sample_dims
        Of one sample, and the names of its dims.
    encoding
        That makes the samples; see `encodings.base.Encoding`.
    frequency_hz
        Of samples over frequency, the axis.
    speed_from
        Where the speed of a sample to classify comes from; see `Model`.
    seed
        Of the first weights.
    """

    n_classes: int
    sample_shape: tuple[int, ...]
    sample_dims: tuple[str, ...]
    encoding: Any = None
    frequency_hz: NDArray[np.float64] | None = None
    speed_from: SpeedFrom = "none"
    seed: int = 0


class FitData(NamedTuple):
    """What a classifier that is solved at once learns from.

    Attributes
    ----------
    values, labels
        Samples (n, *sample_shape), and the numbers of their textures (n,).
    weight, speed_mm_s
        Of each sample, (n,).
    """

    values: Tensor
    labels: Tensor
    weight: Tensor
    speed_mm_s: Tensor


class Classifier(nn.Module, ABC):
    """Recognises textures, once it has learnt to.

    A `Network` learns in a loop (`models.loop`), a `Solved` one at once. To add one, subclass
    either and name it in `models.classifiers.CLASSIFIERS`. Your own needs no subclass: see
    ``classifier`` of `afferents.Model`.

    Attributes
    ----------
    name
        In commands, files and code.
    takes
        Names of the dims of a sample; none for any.
    deployable
        Whether one can be trained on all speeds but one, to be kept and used.
    exportable
        Whether it is made of torch alone, and so can be exported and run live.
    novelty_of_scores
        Whether novelty is measured on the scores of the textures, and not on what enters the
        last layer.
    needs_speed
        Whether it can't learn from recordings whose speed is not known.
    """

    name: ClassVar[str]
    takes: ClassVar[tuple[str, ...]] = ()
    deployable: ClassVar[bool] = True
    exportable: ClassVar[bool] = True
    novelty_of_scores: ClassVar[bool] = False
    needs_speed: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def built_for(cls, task: Task) -> Self:
        """Return one that has learnt nothing yet."""

    def last_features(self, samples: Tensor) -> Tensor:
        """Return what the scores are worked out of, (batch, feature), of scaled samples."""
        raise InputError(f"the classifier: expected one that can run live, found {self.name}")

    def scores_of(self, features: Tensor) -> Tensor:
        """Return the scores of the textures (logits), (batch, n_classes), of last features.

        Here they themselves.
        """
        return features

    def forward(self, samples: Tensor) -> Tensor:
        """Return the scores of the textures, (batch, n_classes), of scaled samples."""
        return self.scores_of(self.last_features(samples))


class Network(Classifier):
    """A classifier that learns in the training loop.

    Attributes
    ----------
    recipe
        How it is trained, a name in `models.config.RECIPES`.
    dense
        Its last layers, a linear one at the end.
    light_dropout
        Share of each dropout layer where it learns from few passes, which dropout before narrow
        layers would leave underfitted; none for its own always.
    """

    recipe: ClassVar[str]
    light_dropout: ClassVar[tuple[float, ...]] = ()
    dense: nn.Sequential

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one, made of the number of textures and the sizes of a sample."""
        return cls(task.n_classes, *task.sample_shape)

    @abstractmethod
    def features(self, samples: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, feature)."""

    def last_features(self, samples: Tensor) -> Tensor:
        """Return what enters the last layer, (batch, feature)."""
        features: Tensor = self.dense[:-1](self.features(samples))
        return features

    def scores_of(self, features: Tensor) -> Tensor:
        """Return logits (batch, n_classes) of what enters the last layer."""
        logits: Tensor = self.dense[-1](features)
        return logits


class Solved(Classifier):
    """A classifier that is solved at once, from all samples.

    Attributes
    ----------
    penalties
        Strengths to choose from inside each fold; one is taken as it is.
    searched
        The same of one that has a single penalty, where a user wants it chosen; none for what has
        nothing to choose.
    adds_up
        Whether what it gathers of samples adds up exactly, and can be taken away again.
    told_speed
        Whether a robot tells it the speeds of samples; `build_classifier` sets it.
    """

    penalties: ClassVar[tuple[float, ...]]
    searched: ClassVar[tuple[float, ...]] = ()
    adds_up: ClassVar[bool] = False
    novelty_of_scores: ClassVar[bool] = True
    told_speed: bool = False
    temperature: Tensor

    @abstractmethod
    def solve(self, data: Any, rng: np.random.Generator, penalty: float) -> None:
        """Learn, in place.

        Parameters
        ----------
        data
            As `gathered` returns them, a `FitData` unless that is written anew.
        rng
            For whatever is drawn.
        penalty
            Strength of it.
        """

    def gathered(self, data: FitData, n_samples: int | None = None) -> Any:
        """Return what it learns from samples, whatever the penalty; here they themselves.

        Parameters
        ----------
        n_samples
            How many there are with those that this is added to, or taken from.
        """
        return data

    @abstractmethod
    def scores(self, values: Tensor, speed_mm_s: Tensor | None = None) -> Tensor:
        """Return the scores of samples, (n, n_classes) or (n, supposed speed, n_classes).

        Speeds, mm/s, are given to a model that a robot tells them alone; None to others.
        """

    def speed(self, values: Tensor, textures: Tensor) -> Tensor | None:
        """Return the speeds of samples that it finds most likely, mm/s, (n,), given their textures.

        None if it does not need the speed, or is given it.
        """
        return None


def build_classifier(kind: type[Classifier], task: Task) -> Classifier:
    """Return a classifier for a task, its first weights, if any, drawn from the task's seed.

    Raises
    ------
    InputError
        If the samples have other dims or are too small, or there are fewer than two textures.
    """
    if task.n_classes < 2:
        raise InputError(
            f"the data: expected at least 2 textures to tell apart, found {task.n_classes}"
        )
    found = f"({', '.join(task.sample_dims)})"
    if kind.takes and task.sample_dims != kind.takes:
        expected = f"({', '.join(kind.takes)})"
        raise InputError(f"the classifier {kind.name}: expected samples {expected}, found {found}")
    if len(task.sample_dims) != len(task.sample_shape):
        raise InputError(f"samples: expected the shape {found}, found {task.sample_shape}")
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(task.seed)
        built = kind.built_for(task)
    if isinstance(built, Solved):
        built.told_speed = task.speed_from == "given"
    return built

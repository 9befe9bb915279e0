"""Classifiers of a user's own: scikit-learn estimators, and functions that make torch modules."""

from collections.abc import Callable
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor, nn

from afferents.core.errors import AfferentsError, InputError, raised
from afferents.models.base import Classifier, FitData, Network, Solved, Task

_TRIAL = 2
"""Samples that a module of somebody's is tried with before it is trained."""
_LEAST = 1e-12
"""Probabilities below are as good as 0."""
_TOLERANCE = 1e-3
"""How far a row of probabilities may be from a sum of 1."""


def own_classifier(wanted: Any) -> type[Classifier]:
    """Return a classifier that wraps an estimator, or a function that makes a module.

    Raises
    ------
    InputError
        If it is neither.
    """
    title = type(wanted).__name__
    made = not isinstance(wanted, type)
    if made and hasattr(wanted, "fit") and hasattr(wanted, "predict_proba"):
        return type("Own" + title, (OwnEstimator,), {"name": title, "estimator": wanted})
    if callable(wanted) and not isinstance(wanted, nn.Module) and not hasattr(wanted, "fit"):
        title = getattr(wanted, "__qualname__", title)
        return type("OwnNetwork", (OwnNetwork,), {"name": title, "make": staticmethod(wanted)})
    raise InputError(
        "classifier",
        "a name, a scikit-learn estimator with predict_proba, or a function (n_classes, "
        "sample_shape) that returns a torch.nn.Module",
        f"{title}{' without predict_proba' if hasattr(wanted, 'fit') else ''}",
    )


class OwnNetwork(Network):
    """A torch module that somebody's function makes, trained in the loop as any network."""

    recipe = ""
    novelty_of_scores = True
    make: Callable[[int, tuple[int, ...]], nn.Module]

    def __init__(self, module: nn.Module, n_classes: int) -> None:
        """Take a module that gives logits."""
        super().__init__()
        self.module, self.n_classes = module, n_classes

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one, after seeing that the module gives what it should.

        Raises
        ------
        InputError
            If the function or the module raises, or gives something else than logits.
        """
        trial = torch.zeros(_TRIAL, *task.sample_shape)
        try:
            module = cls.make(task.n_classes, task.sample_shape)
            made = cls(module, task.n_classes).eval()
            with torch.no_grad():
                logits = made(trial)
        except Exception as error:
            raise AfferentsError(f"the classifier {cls.name}: {raised(error)}") from error
        shape = tuple(getattr(logits, "shape", ()))
        if shape != (_TRIAL, task.n_classes):
            expected = f"logits of shape ({_TRIAL}, {task.n_classes}) of {_TRIAL} samples"
            raise InputError(f"the classifier {cls.name}", expected, f"{shape}")
        return made

    @property
    def n_last(self) -> int:
        """Number of textures, whose scores tell what is unknown."""
        return self.n_classes

    def features(self, samples: Tensor) -> Tensor:
        """Return logits: what a module does inside is its own."""
        logits: Tensor = self.module(samples)
        return logits

    def last_features(self, samples: Tensor) -> Tensor:
        """Return logits (batch, n_classes)."""
        return self.features(samples)

    def scores_of(self, features: Tensor) -> Tensor:
        """Return them."""
        return features

    def forward(self, samples: Tensor) -> Tensor:
        """Return logits (batch, n_classes)."""
        return self.features(samples)


class OwnEstimator(Solved):
    """A scikit-learn estimator on flattened values; its scores are its log-probabilities."""

    penalties = (0.0,)
    exportable = False
    estimator: Any
    fitted: Any

    def __init__(self, n_classes: int) -> None:
        """Copy the estimator, without what it may have learnt."""
        from sklearn.base import clone

        super().__init__()
        self.fitted, self.n_classes = clone(self.estimator), n_classes
        self.register_buffer("temperature", torch.ones(()))

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples of any shape."""
        return cls(task.n_classes)

    @classmethod
    def of_fitted(cls, fitted: Any, task: Task) -> Self:
        """Return one with an estimator that has learnt already."""
        made: type[Self] = own_classifier(fitted)  # type: ignore[assignment]
        classifier = made.built_for(task)
        classifier.fitted = fitted
        return classifier

    @property
    def n_last(self) -> int:
        """Number of textures, whose scores tell what is unknown."""
        return self.n_classes

    def last_features(self, samples: Tensor) -> Tensor:
        """Return log-probabilities: what an estimator does inside is its own."""
        return self.scores(samples)

    def scores_of(self, features: Tensor) -> Tensor:
        """Return them."""
        return features

    def solve(self, data: FitData, rng: np.random.Generator, penalty: float) -> None:
        """Let the estimator learn; it is not told weights or speeds."""
        try:
            self.fitted.fit(data.values.flatten(1).numpy(), data.labels.numpy())
        except Exception as error:
            raise AfferentsError(f"the classifier {self.name}: {raised(error)}") from error

    def scores(self, values: Tensor, speed_mm_s: Tensor | None = None) -> Tensor:
        """Return log-probabilities (n, n_classes).

        Raises
        ------
        AfferentsError
            If the estimator raises, or gives anything but probabilities that sum to one.
        """
        try:
            given = np.asarray(self.fitted.predict_proba(values.flatten(1).numpy()), float)
        except Exception as error:
            raise AfferentsError(f"the classifier {self.name}: {raised(error)}") from error
        classes = [int(c) for c in self.fitted.classes_]
        if given.shape != (len(values), len(classes)):
            raise AfferentsError(
                f"the classifier {self.name}: expected probabilities of shape "
                f"({len(values)}, {len(classes)}), found {given.shape}"
            )
        if not np.isfinite(given).all() or (given < 0).any():
            raise AfferentsError(
                f"the classifier {self.name}: expected probabilities, found values that are "
                "negative, infinite or no numbers"
            )
        off = np.abs(given.sum(axis=1) - 1).max(initial=0.0)
        if off > _TOLERANCE:
            raise AfferentsError(
                f"the classifier {self.name}: expected probabilities that sum to 1, found a row "
                f"that is off by {off:.3g}"
            )
        every = np.zeros((len(values), self.n_classes))
        every[:, classes] = given
        return torch.from_numpy(np.log(np.maximum(every, _LEAST))).float()

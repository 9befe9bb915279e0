"""The classifiers by name, and a user's own: scikit-learn estimators, and torch modules."""

from collections.abc import Callable
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor, nn

from afferents.errors import AfferentsError, InputError, raised
from afferents.models import base, fusion, networks, orders, solved

_TRIAL = 2
"""Samples that a user's module is tried with before it is trained."""
_LEAST = 1e-12
"""Probabilities below are as good as 0."""
_TOLERANCE = 1e-3
"""How far a row of probabilities may be from a sum of 1."""

CLASSIFIERS: dict[str, type[base.Classifier]] = {
    kind.name: kind
    for kind in (
        networks.SpatialNet, networks.CnnLstm, networks.VibrationNet,
        solved.Ridge, orders.OrderSearch, fusion.LateFusion, solved.Discriminant,
    )
}  # fmt: skip
"""The paper's three networks, then ours."""


def get_classifier(wanted: Any) -> type[base.Classifier]:
    """Return the classifier of that name, or one that wraps what is given.

    Parameters
    ----------
    wanted
        A name; a `Classifier`; a scikit-learn estimator with `predict_proba`; or a function from
        the number of textures and the shape of a sample to a torch module.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if isinstance(wanted, type) and issubclass(wanted, base.Classifier):
        return wanted
    if isinstance(wanted, str):
        if wanted not in CLASSIFIERS:
            known = f"one of {', '.join(CLASSIFIERS)}, or an object"
            raise InputError(f"classifier: expected {known}, found '{wanted}'")
        return CLASSIFIERS[wanted]
    title = type(wanted).__name__
    is_made = not isinstance(wanted, type)
    if is_made and hasattr(wanted, "fit") and hasattr(wanted, "predict_proba"):
        return type("Own" + title, (OwnEstimator,), {"name": title, "estimator": wanted})
    if callable(wanted) and not isinstance(wanted, nn.Module) and not hasattr(wanted, "fit"):
        title = getattr(wanted, "__qualname__", title)
        return type("OwnNetwork", (OwnNetwork,), {"name": title, "make": staticmethod(wanted)})
    raise InputError(
        "classifier: expected a name, a scikit-learn estimator with predict_proba, or a function "
        "(n_classes, sample_shape) that returns a torch.nn.Module, found "
        f"{title}{' without predict_proba' if hasattr(wanted, 'fit') else ''}"
    )


def build(
    classifier: Any, n_classes: int, sample_shape: tuple[int, ...], seed: int = 0
) -> base.Classifier:
    """Return a classifier for samples of a shape, nothing learnt yet.

    Parameters
    ----------
    classifier
        See `get_classifier`.
    n_classes
        Number of textures, at least 2.
    sample_shape
        Of one sample: (row, column), (frame, row, column), (channel, frequency), whatever it takes.
    seed
        Of the first weights; the caller's random state is left as it was.

    Raises
    ------
    InputError
        If the samples have another number of dims or are too small, or there are fewer
        than two textures.
    """
    kind = get_classifier(classifier)
    dims = kind.takes or tuple(f"dim_{i}" for i in range(len(sample_shape)))
    return base.build_classifier(kind, base.Task(n_classes, sample_shape, dims, seed=seed))


class OwnNetwork(base.Network):
    """A torch module that a user's function makes, trained in the loop as any network."""

    recipe = ""
    novelty_of_scores = True
    make: Callable[[int, tuple[int, ...]], nn.Module]

    def __init__(self, module: nn.Module, n_classes: int) -> None:
        """Take a module that gives logits."""
        super().__init__()
        self.module, self.n_classes = module, n_classes

    @classmethod
    def built_for(cls, task: base.Task) -> Self:
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
            raise InputError(f"the classifier {cls.name}: expected {expected}, found {shape}")
        return made

    def features(self, samples: Tensor) -> Tensor:
        """Return logits: what a module does inside is its own."""
        logits: Tensor = self.module(samples)
        return logits

    def last_features(self, samples: Tensor) -> Tensor:
        """Return logits (batch, n_classes)."""
        return self.features(samples)

    def scores_of(self, features: Tensor) -> Tensor:
        """Return the features, which are the logits."""
        return features


class OwnEstimator(base.Solved):
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
    def built_for(cls, task: base.Task) -> Self:
        """Return one for samples of any shape."""
        return cls(task.n_classes)

    def last_features(self, samples: Tensor) -> Tensor:
        """Return log-probabilities: what an estimator does inside is its own."""
        return self.scores(samples)

    def solve(self, data: base.FitData, rng: np.random.Generator, penalty: float) -> None:
        """Let the estimator learn, without weights or speeds."""
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

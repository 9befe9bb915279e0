"""Classifiers of a user's own: scikit-learn estimators, and functions that make torch modules."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
import torch
from torch import Tensor, nn

from afferents.errors import AfferentsError, InputError, raised
from afferents.models.base import Classifier, FitData, Network, Solved, Task
from afferents.plugins import imported, reference_of

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
        "classifier: expected a name, a scikit-learn estimator with predict_proba, or a function "
        "(n_classes, sample_shape) that returns a torch.nn.Module, found "
        f"{title}{' without predict_proba' if hasattr(wanted, 'fit') else ''}"
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
            raise InputError(f"the classifier {cls.name}: expected {expected}, found {shape}")
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


# A fitted scikit-learn estimator on disk, as skops stores it: never as a pickle.
#
# A pickle runs whatever it holds when it is read. A file of skops names the types in it, and is
# read only if all of them are trusted: those that skops itself trusts, classes of scikit-learn,
# and estimator classes of a user's own that the model's card names, which are imported.

_WHAT = "an estimator whose types are scikit-learn's, or estimators of a module of one's own"


def save_estimator(fitted: Any, path: Path) -> None:
    """Write a fitted estimator; see `own_types` for what can be written."""
    path.write_bytes(_stored(fitted))


def own_types(classifier: Classifier) -> tuple[str, ...] | None:
    """Return the classes of a user's own in a fitted estimator, each as ``module:NAME``.

    None if the classifier is no estimator.

    Raises
    ------
    InputError
        If it can't be stored, or holds what could not be trusted when it is read: a function, or a
        class of a script or a notebook.
    """
    if not isinstance(classifier, OwnEstimator):
        return None
    content = _stored(classifier.fitted)
    own = [name for name in _untrusted(content) if not name.startswith("sklearn.")]
    found = [_of_name(name) for name in own]
    references = tuple(reference_of(one) for one in found)
    _load(content, references, "classifier")
    return references


def load_estimator(path: Path, own: Sequence[str]) -> Any:
    """Read a fitted estimator.

    Parameters
    ----------
    own
        Classes of a user's own that may be in it, each as ``module:NAME``; they are imported.

    Raises
    ------
    InputError
        If the file is missing, damaged, or holds anything else.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path}: expected an estimator that can be read, found {raised(error)}"
        ) from error
    return _load(content, own, path)


def _stored(fitted: Any) -> bytes:
    from skops.io import dumps

    try:
        return bytes(dumps(fitted))
    except Exception as error:
        raise InputError(
            f"classifier: expected an estimator that skops can store, found {raised(error)}"
        ) from error


def _load(content: bytes, own: Sequence[str], where: object) -> Any:
    from sklearn.base import BaseEstimator
    from skops.io import loads

    trusted = [imported(reference) for reference in own]
    for one, reference in zip(trusted, own, strict=True):
        if not (isinstance(one, type) and issubclass(one, BaseEstimator)):
            raise InputError(f"{where}: expected {_WHAT}, found {reference}")
    try:
        trusted += [
            _of_sklearn(name) for name in _untrusted(content) if name.startswith("sklearn.")
        ]
        found = loads(content, trusted=trusted)
    except AfferentsError:
        raise
    except Exception as error:
        raise InputError(f"{where}: expected {_WHAT}, found {raised(error)}") from error
    if not (hasattr(found, "predict_proba") and hasattr(found, "classes_")):
        raise InputError(
            f"{where}: expected a fitted estimator with predict_proba, found {type(found).__name__}"
        )
    return found


def _of_sklearn(name: str) -> type:
    """Return a class of scikit-learn by its name, not one that it has imported from elsewhere."""
    found = _of_name(name)
    if not isinstance(found, type) or not found.__module__.startswith("sklearn."):
        raise InputError(f"estimator: expected {_WHAT}, found {name}")
    return found


def _of_name(name: str) -> Any:
    """Return what skops names ``module.NAME``."""
    return imported(":".join(name.rpartition(".")[::2]))


def _untrusted(content: bytes) -> list[str]:
    from skops.io import get_untrusted_types

    return list(get_untrusted_types(data=content))

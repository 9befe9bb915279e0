"""Classifiers that least squares solves at once: a ridge, and a linear discriminant.

Nothing is searched for. Scores of the textures are linear in the values; probabilities are the
softmax of the scores over a temperature, which a speed not learnt from sets.

Why not scikit-learn: its discriminant takes no sample weights, and none of its models subtracts the
samples of one speed from sums made once. A search for the penalty took 1.8 to 15 times as long.
"""

import operator
from functools import reduce
from typing import ClassVar, Self, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.folds.protocol import Indices
from afferents.models.base import FitData, Solved, Task

PENALTY = 30.0
"""Of the penalty, in samples of one texture's weight; chosen on inner folds of a tuning session."""
SEARCHED = (3.0, 30.0, 300.0, 3e3, 3e4)
"""Penalties to choose from inside a fold, where a user requests it."""
SHRINKAGE = 0.1
"""Of the covariance of the discriminants of `predict_left_out`.

Fixed after 0.001 to 10 had been tried at held-out speeds of one simulated session.
"""
_LEAST_SD = 0.1
"""Of a value that hardly varies: logarithms of power that do are not trusted to the last digit."""

_LEAST_SHARE = 1e-10
"""Of a value's square that its variance may be: of one that never varies, rounding is left."""
_LEAST_VARIANCE = 1e-200
"""Of a value that is always 0, so that nothing is divided by 0."""


class Gram:
    """What least squares needs of all samples, gathered in parts: X'WX and X'WY.

    Parameters
    ----------
    n_features, n_targets
        Columns of X, the constant not counted, and of Y.
    """

    def __init__(self, n_features: int, n_targets: int) -> None:
        """Start with no samples."""
        self._xx = torch.zeros(n_features + 1, n_features + 1, dtype=torch.float64)
        self._xy = torch.zeros(n_features + 1, n_targets, dtype=torch.float64)

    def add(self, x: Tensor, y: Tensor, weight: Tensor) -> None:
        """Add samples (n, feature), their targets (n, target) and weights (n,)."""
        root = weight.double().sqrt()[:, None]
        x = torch.cat([x.double(), torch.ones(len(x), 1, dtype=torch.float64)], 1) * root
        rows = x.numpy()
        self._xx += torch.from_numpy(rows.T @ rows)  # half the work in NumPy, as it is symmetric
        self._xy += x.T @ (root * y.double())

    def __sub__(self, other: "Gram") -> "Gram":
        """Return what is needed of these samples without those of another."""
        return self.__add__(other, -1)

    def __add__(self, other: "Gram", sign: int = 1) -> "Gram":
        """Return what is needed of the samples of both."""
        joined = Gram(len(self._xx) - 1, self._xy.shape[1])
        joined._xx, joined._xy = self._xx + sign * other._xx, self._xy + sign * other._xy
        return joined

    def solve(self, strength: float | Tensor) -> tuple[Tensor, Tensor]:
        """Return weights (feature, target) and constants (target,); the latter not penalised.

        Parameters
        ----------
        strength
            Of the penalty, for all features or of each, (feature,).
        """
        penalty = torch.full((len(self._xx),), 1e-6, dtype=torch.float64)
        penalty[:-1] = strength
        solved = torch.linalg.solve(self._xx + torch.diag(penalty), self._xy).float()
        return solved[:-1], solved[-1]

    def solve_as_discriminant(self, shrinkage: float) -> tuple[Tensor, Tensor]:
        """Return weights and constants of what `Discriminant` learns from these samples.

        Targets are 1 for the class of a sample, and 0 for the others. A class without samples is
        taken to lie in the middle of all.
        """
        n = self._xx[-1, -1]
        share, mean = self._xy[-1] / n, self._xx[:-1, -1] / n
        second = self._xx[:-1, :-1] / n
        covariance = second - torch.outer(mean, mean)
        off = torch.where(share > 0, self._xy[:-1] / self._xy[-1] - mean[:, None], 0.0)
        within = covariance - (off * share) @ off.T
        variance = torch.maximum(covariance.diagonal(), _LEAST_SHARE * second.diagonal())
        penalty = shrinkage * variance.clamp_min(_LEAST_VARIANCE)
        solved = torch.linalg.solve(within + torch.diag(penalty), off)
        return solved.float(), (-((mean[:, None] + off / 2) * solved).sum(0)).float()


class Rows:
    """What a `Gram` is for, of samples that are fewer than their features: the samples themselves.

    Weights are the same, up to rounding, but there are as many unknowns as samples (the matrix
    inversion lemma: Woodbury, Princeton Statistical Research Group Memo 42, 1950).

    Parameters
    ----------
    x, y, weight
        Samples (n, feature), their targets (n, target) and weights (n,).
    """

    def __init__(self, x: Tensor, y: Tensor, weight: Tensor) -> None:
        """Keep the samples."""
        self._x, self._y, self._weight = x.double(), y.double(), weight.double()

    def __add__(self, other: "Rows") -> "Rows":
        """Return the samples of both."""
        mine, its = (self._x, self._y, self._weight), (other._x, other._y, other._weight)
        return Rows(*(torch.cat(pair) for pair in zip(mine, its, strict=True)))

    def solve(self, strength: float | Tensor) -> tuple[Tensor, Tensor]:
        """Return weights and constants, as `Gram.solve`."""
        share, root = self._weight / self._weight.sum(), self._weight.sqrt()[:, None]
        x_mean, y_mean = share @ self._x, share @ self._y
        x = root * (self._x - x_mean)
        scaled = x / strength
        solved = scaled.T @ _solve_plus_one(scaled @ x.T, root * (self._y - y_mean))
        return solved.float(), (y_mean - x_mean @ solved).float()

    def solve_as_discriminant(self, shrinkage: float) -> tuple[Tensor, Tensor]:
        """Return weights and constants, as `Gram.solve_as_discriminant`."""
        share = self._weight / self._weight.sum()
        of_class, mean = (share @ self._y)[:, None], share @ self._x
        means = torch.where(of_class > 0, (share[:, None] * self._y).T @ self._x / of_class, mean)
        off = means - mean
        within = share.sqrt()[:, None] * (self._x - self._y @ means)
        least = _LEAST_SHARE * (share @ self._x.square())
        variance = torch.maximum(share @ (self._x - mean).square(), least)
        penalty = shrinkage * variance.clamp_min(_LEAST_VARIANCE)
        scaled = within / penalty
        solved = (off / penalty).T - scaled.T @ _solve_plus_one(scaled @ within.T, scaled @ off.T)
        return solved.float(), (-((mean + off / 2) * solved.T).sum(1)).float()


def _solve_plus_one(kernel: Tensor, right: Tensor) -> Tensor:
    """Solve for a kernel (n, n) whose diagonal gains 1."""
    solved: Tensor = torch.linalg.solve(kernel + torch.eye(len(kernel)), right)
    return solved


def sums(x: Tensor, y: Tensor, weight: Tensor, n_samples: int | None = None) -> Gram | Rows:
    """Return what least squares needs of samples (n, feature), targets (n, target), weights (n,).

    Parameters
    ----------
    n_samples
        How many there will be once these are added to others; None for these alone.
    """
    if (n_samples or len(x)) < x.shape[1]:
        return Rows(x, y, weight)
    gram = Gram(x.shape[1], y.shape[1])
    gram.add(x, y, weight)
    return gram


class Ridge(Solved):
    """Scores of textures from flattened values: one dense layer on standardised ones.

    The targets are 1 for the texture that it is and 0 for the others (Hoerl & Kennard,
    Technometrics 1970, 12:55).

    Parameters
    ----------
    n_classes
        Number of textures.
    sample_shape
        Of one sample.
    """

    name = "ridge"
    penalties: ClassVar[tuple[float, ...]] = (PENALTY,)
    searched: ClassVar[tuple[float, ...]] = SEARCHED
    mean: Tensor
    sd: Tensor

    def __init__(self, n_classes: int, sample_shape: tuple[int, ...]) -> None:
        """Start with nothing learnt."""
        super().__init__()
        self.n_classes = n_classes
        n = torch.Size(sample_shape).numel()
        self.register_buffer("mean", torch.zeros(n))
        self.register_buffer("sd", torch.ones(n))
        self.register_buffer("temperature", torch.ones(()))
        linear = nn.Linear(n, n_classes)
        nn.init.zeros_(linear.weight)
        nn.init.zeros_(linear.bias)
        self.dense = nn.Sequential(linear).requires_grad_(False)

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples of any shape."""
        return cls(task.n_classes, task.sample_shape)

    def gathered(self, data: FitData, n_samples: int | None = None) -> Gram | Rows:
        """Return the sums of samples, whose speeds tell nothing; standardise by them."""
        flat = data.values.flatten(1)
        self.mean, self.sd = flat.mean(0), flat.std(0, correction=0).clamp_min(_LEAST_SD)
        targets = nn.functional.one_hot(data.labels, self.n_classes)
        return sums(self.last_features(data.values), targets, data.weight, n_samples)

    def solve(self, data: Gram | Rows, rng: np.random.Generator, penalty: float) -> None:
        """Learn from the sums of samples, in place."""
        self._take(*data.solve(penalty))

    def _take(self, weight: Tensor, constant: Tensor) -> None:
        linear = cast("nn.Linear", self.dense[0])
        linear.weight.copy_(weight.T)
        linear.bias.copy_(constant)

    def last_features(self, samples: Tensor) -> Tensor:
        """Return the standardised values of samples, (n, feature)."""
        features: Tensor = (samples.flatten(1) - self.mean) / self.sd
        return features

    def scores_of(self, features: Tensor) -> Tensor:
        """Return the scores of standardised values, (n, n_classes)."""
        scores: Tensor = self.dense(features)
        return scores

    def scores(self, values: Tensor, speed_mm_s: Tensor | None = None) -> Tensor:
        """Return the scores of samples, (n, n_classes), whatever their speeds."""
        return self.scores_of(self.last_features(values))


def log_probabilities(scores: Tensor, temperature: Tensor | float) -> Tensor:
    """Return the log-probabilities of textures that scores mean at a temperature, (n, n_classes).

    Parameters
    ----------
    scores
        (n, n_classes), or (n, supposed speed, n_classes): a texture's probability is then the sum
        over its speeds.
    """
    joint = (scores / temperature).flatten(1).log_softmax(1).reshape(scores.shape)
    logs: Tensor = joint.logsumexp(1) if joint.ndim == 3 else joint
    return logs


def equal_weights(labels: Tensor, groups: Tensor) -> Tensor:
    """Return weights, mean 1, under which every texture counts the same in every group.

    Groups are numbers, such as the speeds.
    """
    _, condition, count = torch.unique(
        torch.stack([labels.double(), groups.double()]),
        dim=1, return_inverse=True, return_counts=True,
    )  # fmt: skip
    weight = 1 / count[condition].double()
    relative: Tensor = weight / weight.mean()
    return relative.float()


class Discriminant(Ridge):
    """A linear discriminant, whose covariance within textures is shrunk.

    Textures are clouds of one shape about different means. A score is the logarithm of a
    Gaussian's density, less what all textures share: linear in the values (Fisher, Ann. Eugenics
    1936, 7:179). It is for few values, of which a texture may take a middle one: there a ridge on
    indicators of the textures names the outer ones alone (Hastie, Tibshirani & Friedman, The
    Elements of Statistical Learning, 2009, section 4.2).

    The covariance's diagonal gains a share of each value's variance over all samples (Friedman,
    J. Am. Stat. Assoc. 1989, 84:165). The share is the penalty, chosen inside each fold.
    """

    name = "discriminant"
    penalties = (0.01, 0.1, 1.0)
    adds_up = True

    def gathered(self, data: FitData, n_samples: int | None = None) -> Gram | Rows:
        """Return the sums of samples."""
        targets = nn.functional.one_hot(data.labels, self.n_classes)
        return sums(data.values.flatten(1), targets, data.weight, n_samples)

    def solve(self, data: Gram | Rows, rng: np.random.Generator, penalty: float) -> None:
        """Learn from the sums of samples, in place."""
        self._take(*data.solve_as_discriminant(penalty))


def predict_left_out(
    values: NDArray[np.float32], labels: Indices, groups: Indices, sharing: NDArray[np.bool_]
) -> Indices:
    """Return the textures (n,) that discriminants name which have not learnt from a sample's group.

    It is quick, since every group's sums are made once. Nothing is chosen on these data.

    Parameters
    ----------
    values
        (n, feature).
    labels, groups
        Numbers of textures and of groups, such as speeds, (n,).
    sharing
        Which groups (of all, in order) are not learnt from where each is left out.
    """
    x, n_classes = torch.from_numpy(values), int(labels.max()) + 1
    at = [np.flatnonzero(groups == group) for group in np.unique(groups)]
    of_group = []
    for index in at:  # every texture counts the same in each
        named = torch.from_numpy(labels[index])
        weight = equal_weights(named, torch.zeros(len(named)))
        targets = nn.functional.one_hot(named, n_classes)
        of_group.append(sums(x[index], targets, weight, len(x)))
    found = np.empty(len(values), np.int64)
    for index, without in zip(at, sharing, strict=True):
        kept = [its for its, gone in zip(of_group, without, strict=True) if not gone]
        learnt: Gram | Rows = reduce(operator.add, kept)
        weight, constant = learnt.solve_as_discriminant(SHRINKAGE)
        found[index] = (x[index] @ weight + constant).argmax(1).numpy()
    return found

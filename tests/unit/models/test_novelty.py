"""Novelty: distances by hand, and the share of known samples that the limit lets through."""

import numpy as np
import pytest
import torch

from afferents.models.base import FitData
from afferents.models.confidence import KNOWN, Novelty
from afferents.models.solved import PENALTY, Gram, Ridge, equal_weights, sum_of


def test_by_hand():
    """Two classes at 0 and 10, both with variances 1 and 4: the second value counts half."""
    spread = torch.tensor([[1.0, 2.0], [1.0, -2.0], [-1.0, 2.0], [-1.0, -2.0]])
    values = torch.cat([spread, spread + torch.tensor([10.0, 0.0])])
    novelty = Novelty(2, 2)
    novelty.fit_classes(values, torch.tensor([0] * 4 + [1] * 4))
    asked = torch.tensor([[0.0, 0.0], [3.0, 0.0], [10.0, 6.0], [5.0, 0.0]])
    np.testing.assert_allclose(novelty.distance(asked), [0, 3, 3, 5], rtol=0.02)
    novelty.set_limit(torch.tensor([3.0, 3.0, 3.0]))
    np.testing.assert_allclose(novelty(asked), [0, 1, 1, 5 / 3], rtol=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_known_samples_are_below_1_as_often_as_stated(seed):
    rng = np.random.default_rng(seed)
    labels = np.tile(np.arange(4), 2000)
    means = rng.normal(0, 5, (4, 6))

    def drawn():
        return torch.from_numpy((means[labels] + rng.normal(size=(len(labels), 6))).astype("f4"))

    novelty = Novelty(4, 6)
    novelty.fit(drawn(), torch.from_numpy(labels), drawn())
    assert (novelty(drawn()) <= 1).float().mean() == pytest.approx(KNOWN, abs=0.01)
    assert (novelty(drawn() + 40) > 1).all()


def test_a_value_that_never_varies_does_no_harm():
    values = torch.zeros(40, 3)
    values[:, 0] = torch.arange(40) % 2 + torch.linspace(0, 0.1, 40)
    novelty = Novelty(2, 3)
    novelty.fit(values, torch.arange(40) % 2, values)
    assert torch.isfinite(novelty(values)).all()


def test_a_ridge_of_sums_is_the_ridge_of_samples():
    rng = np.random.default_rng(0)
    labels, speed = np.repeat(np.arange(3), 40), np.tile(np.repeat([10.0, 20.0], 20), 3)
    scale = np.array([0.5, 1, 5, 20, 0.01])
    values = torch.from_numpy((rng.normal(3, 1, (120, 5)) * scale).astype("f4"))
    named, weight = torch.from_numpy(labels), equal_weights(*map(torch.from_numpy, (labels, speed)))
    targets = torch.nn.functional.one_hot(named)
    grams = []
    for part in np.array_split(np.arange(120), 4):
        grams.append(Gram(5, 3))
        grams[-1].add(values[part], targets[part], weight[part])
    ridge = Ridge(3, (5,))
    ridge.solve(FitData(values, named, weight, weight), np.random.default_rng(0), PENALTY)
    weights, constants = sum_of(grams).solve_as_ridge()
    np.testing.assert_allclose(values @ weights + constants, ridge.scores(values), atol=1e-4)

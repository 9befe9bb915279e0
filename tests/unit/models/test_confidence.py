"""Temperatures, weights and novelty: as often right, and as often strange, as they say."""

import numpy as np
import pytest
import torch
from scipy.special import log_softmax

from afferents.models.calibrate import cross_entropy
from afferents.models.deployed import KNOWN, Novelty
from afferents.models.fusion import best_weights, join


def guesses(n, sharpness, rng):
    """Logits of labels, noisy: the larger the sharpness the more they tell."""
    labels = rng.integers(0, 4, n)
    return log_softmax(sharpness * np.eye(4)[labels] + rng.normal(size=(n, 4)), axis=1), labels


def test_a_part_that_knows_nothing_gets_no_weight():
    rng = np.random.default_rng(0)
    knows, labels = guesses(4000, 3.0, rng)
    noise, _ = guesses(4000, 3.0, rng)
    good, none = best_weights([knows, noise], labels)
    assert none < 0.05 * good


def test_two_parts_surprise_less_than_either():
    rng = np.random.default_rng(1)
    one, labels = guesses(4000, 2.0, rng)
    other = log_softmax(2.0 * np.eye(4)[labels] + rng.normal(size=(4000, 4)), axis=1)
    fused = join([one, other], best_weights([one, other], labels))
    np.testing.assert_allclose(np.exp(fused).sum(1), 1)
    missing = join([one, np.zeros_like(one)], np.array([1.0, 5.0]))
    np.testing.assert_allclose(missing, one, atol=1e-12)
    assert cross_entropy(fused, labels) < 0.8 * min(
        cross_entropy(part, labels) for part in (one, other)
    )


def test_distances_by_hand():
    """Two classes at 0 and 10, both with variances 1 and 4: the second value counts half."""
    spread = torch.tensor([[1.0, 2.0], [1.0, -2.0], [-1.0, 2.0], [-1.0, -2.0]])
    values = torch.cat([spread, spread + torch.tensor([10.0, 0.0])])
    novelty = Novelty(2, 2)
    three_off = torch.tensor([[3.0, 0.0], [10.0, 6.0], [10.0, -6.0]])
    novelty.fit(values, torch.tensor([0] * 4 + [1] * 4), three_off)
    asked = torch.tensor([[0.0, 0.0], [3.0, 0.0], [10.0, 6.0], [5.0, 0.0]])
    np.testing.assert_allclose(novelty.distance(asked), [0, 3, 3, 5], rtol=0.02)
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

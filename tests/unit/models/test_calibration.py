"""Temperatures and weights: probabilities come out as often right as they say."""

import numpy as np
import pytest
from scipy.special import log_softmax

from afferents.models.confidence import best_weights, cross_entropy, weighted


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
    fused = weighted([one, other], best_weights([one, other], labels))
    np.testing.assert_allclose(np.exp(fused).sum(1), 1)
    assert cross_entropy(fused, labels) < 0.8 * min(
        cross_entropy(part, labels) for part in (one, other)
    )


def test_a_missing_part_changes_nothing():
    rng = np.random.default_rng(2)
    one, _ = guesses(10, 2.0, rng)
    np.testing.assert_allclose(
        weighted([one, np.zeros((10, 4))], np.array([1.0, 5.0])), one, atol=1e-12
    )


def test_surprise_is_the_mean_of_minus_log_p():
    logs = np.log([[0.5, 0.5], [0.9, 0.1]])
    assert cross_entropy(logs, np.array([0, 1])) == pytest.approx(-np.log([0.5, 0.1]).mean())

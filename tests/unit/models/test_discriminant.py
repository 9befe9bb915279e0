"""A linear discriminant: the Gaussian truth, and what it does that a ridge can't."""

import numpy as np
import torch

from afferents import dims
from afferents.models.base import FitData, Task, build_for
from afferents.models.solved import Discriminant, Gram, Ridge


def fitted(kind, values, labels, penalty, n_classes=3):
    task = Task(n_classes, values.shape[1:], (dims.FEATURE,))
    classifier = build_for(kind, task)
    ones = torch.ones(len(values))
    classifier.solve(FitData(values, labels, ones, ones), np.random.default_rng(0), penalty)
    return classifier


def clouds(means, n=4000, sd=1.0):
    torch.manual_seed(0)
    means = torch.tensor(means)
    labels = torch.arange(len(means)).repeat_interleave(n)
    return means[labels] + sd * torch.randn(len(labels), means.shape[1]), labels


def test_a_texture_between_two_others_is_named():
    """On one axis a ridge on indicators never names the middle one."""
    values, labels = clouds([[-2.0], [0.0], [2.0]], sd=0.5)
    middle = values[labels == 1]
    named = fitted(Discriminant, values, labels, 0.01).scores(middle).argmax(1)
    assert (named == 1).float().mean() > 0.9
    assert (fitted(Ridge, values, labels, 30.0).scores(middle).argmax(1) == 1).float().mean() < 0.1


def test_scores_are_log_densities_of_gaussians():
    """Of unit covariance: log p(k) - log p(j) = x (m_k - m_j) - (m_k^2 - m_j^2) / 2."""
    means = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]]
    scores = fitted(Discriminant, *clouds(means, 40000), 0.0).scores(torch.tensor([[0.5, 0.5]]))
    expected = torch.tensor([0.0, 0.5 - 0.5, 1.0 - 2.0])
    np.testing.assert_allclose(scores[0] - scores[0, 0], expected, atol=0.05)


def test_a_value_that_never_varies_and_a_texture_without_samples_do_no_harm():
    values, labels = clouds([[-1.0, 3.0], [1.0, 3.0]])
    values[:, 1] = 3.0
    scores = fitted(Discriminant, values, labels, 0.1).scores(values)
    assert torch.isfinite(scores).all()
    assert (scores[:, :2].argmax(1) == labels).float().mean() > 0.8


def test_sums_of_some_features_are_those_of_the_samples():
    values, labels = clouds([[0.0, 1.0, 2.0], [1.0, 0.0, 5.0]], 20)
    targets, weight = torch.nn.functional.one_hot(labels), torch.ones(len(labels))
    whole, part = Gram(3, 2), Gram(2, 2)
    whole.add(values, targets, weight)
    part.add(values[:, [0, 2]], targets, weight)
    for one, other in zip(
        whole.of(torch.tensor([0, 2])).solve(1.0), part.solve(1.0), strict=True
    ):  # fmt: skip
        np.testing.assert_allclose(one, other, rtol=1e-6)

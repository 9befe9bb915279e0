"""Small problems that a network can learn, and a small network."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from afferents.models.config import TrainingConfig

from ...extras import ABSENT

if TYPE_CHECKING:
    import torch
    from torch import nn


class Problem(NamedTuple):
    values: "torch.Tensor"
    labels: "torch.Tensor"
    train: np.ndarray
    validation: np.ndarray


def separable(shape: tuple[int, ...], n: int = 192, noise: float = 0.3) -> Problem:
    """Three classes, each a pattern of its own plus noise; two thirds train, one validates."""
    import torch

    rng = np.random.default_rng(0)
    labels = np.arange(n) % 3
    patterns = rng.normal(size=(3, *shape))
    values = patterns[labels] + noise * rng.normal(size=(n, *shape))
    index = rng.permutation(n)
    return Problem(
        torch.from_numpy(values.astype(np.float32)),
        torch.from_numpy(labels),
        index[n // 3 :],
        index[: n // 3],
    )


@pytest.fixture
def make_problem():
    return separable


@pytest.fixture
def problem() -> Problem:
    return separable((6,))


@pytest.fixture
def small_net() -> "nn.Module":
    import torch
    from torch import nn

    torch.manual_seed(0)
    return nn.Sequential(
        nn.Linear(6, 8), nn.ReLU(), nn.BatchNorm1d(8), nn.Dropout(0.2), nn.Linear(8, 3)
    )


@pytest.fixture
def config() -> TrainingConfig:
    return TrainingConfig(
        learning_rate=1e-2,
        batch_size=32,
        patience=3,
        max_epochs=6,
        precision="float32",
        device="cpu",
    )


@pytest.fixture(autouse=True)
def _one_thread():
    """As in every training of ours: then the same steps on one machine agree to the last bit."""
    if "torch" in ABSENT:
        yield
        return
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)

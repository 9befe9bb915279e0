"""A part that a model does not look at costs nothing; one that it does, what it is worth."""

import numpy as np
from hypothesis import given, strategies as st

from afferents.reporting.explain import log_odds, losses, patches


def looks_at(row, column):
    """A model of two textures that looks at one marker alone."""

    def say(images):
        value = images[:, row, column].astype(np.float64)
        logits = np.stack([value, -value], 1)
        return logits - np.logaddexp(*logits.T)[:, None]

    return say


@given(row=st.integers(0, 4), column=st.integers(0, 6), size=st.sampled_from([1, 3]))
def test_only_what_is_looked_at_costs(row, column, size):
    images = np.random.default_rng(row).normal(size=(6, 5, 7)).astype(np.float32)
    labels = (images[:, row, column] < 0).astype(int)
    covers = patches((5, 7), size)
    found = losses(
        looks_at(row, column), images, labels, covers, np.zeros((5, 7), np.float32)
    ).reshape(5, 7, 6)
    near = np.zeros((5, 7), bool)
    half = size // 2
    near[max(0, row - half) : row + half + 1, max(0, column - half) : column + half + 1] = True
    assert (found[~near] == 0).all()
    # Its log-odds are twice the value, and 0 without it.
    expected = np.broadcast_to(2 * np.abs(images[:, row, column]), (near.sum(), 6))
    np.testing.assert_allclose(found[near], expected, rtol=1e-6)


def test_log_odds_by_hand():
    logs = np.log([[0.8, 0.1, 0.1], [0.25, 0.25, 0.5]])
    np.testing.assert_allclose(log_odds(logs, np.array([0, 1])), np.log([4, 1 / 3]))

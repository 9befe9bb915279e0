import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from afferents.evaluation.metrics import reliability, reliability_of


def test_by_hand():
    """Two of four right at 0.5 and 0.6, one bin; one right at 0.9, another."""
    found = reliability(np.array([0.5, 0.6, 0.5, 0.6, 0.9]), np.array([1, 0, 1, 0, 1], bool), 2)
    # 0.5 belongs to the lower bin: both right; above it one of three right.
    assert found.count == (2, 3)
    np.testing.assert_allclose(found.confidence, [0.5, 0.7])
    np.testing.assert_allclose(found.accuracy, [1, 1 / 3])
    assert found.ece == pytest.approx((2 * 0.5 + 3 * (0.7 - 1 / 3)) / 5)


def test_sure_and_wrong_is_the_worst():
    assert reliability(np.ones(4), np.zeros(4, bool)).ece == 1
    assert reliability(np.ones(4), np.ones(4, bool)).ece == 0


def test_predictions_without_probabilities_say_nothing():
    rows = pd.DataFrame({"true_texture": ["a", "b"], "predicted_texture": ["a", "a"]})
    assert reliability_of(rows) is None
    found = reliability_of(rows.assign(p_a=[0.8, 0.8], p_b=[0.2, 0.2]))
    assert found.ece == pytest.approx(0.3)


shares = st.floats(0, 1, width=32)


@given(st.integers(1, 50).flatmap(lambda n: st.tuples(
    arrays(np.float32, n, elements=shares), arrays(bool, n)
)), st.integers(1, 20))  # fmt: skip
def test_every_sample_is_in_a_bin_and_the_error_is_a_share(samples, n_bins):
    confidence, right = samples
    found = reliability(confidence, right, n_bins)
    assert sum(found.count) == len(confidence)
    assert np.dot(found.count, found.accuracy) == pytest.approx(right.sum())
    total = confidence.sum(dtype=float)
    assert np.dot(found.count, found.confidence) == pytest.approx(total, abs=1e-6)
    assert 0 <= found.ece <= 1


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.floats(0.5, 4))
def test_who_is_right_as_often_as_he_says_errs_little(seed, power):
    rng = np.random.default_rng(seed)
    confidence = rng.uniform(size=50_000) ** (1 / power)
    found = reliability(confidence, rng.uniform(size=50_000) < confidence)
    assert found.ece < 0.02

import numpy as np
import pandas as pd
import pytest

from afferents.evaluation.metrics import (
    accuracy_by_speed,
    bootstrap_interval,
    confusion,
    macro_f1,
)


def table(rows):
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    return pd.DataFrame(rows, columns=names)


def test_by_hand():
    """Four samples at 10 mm/s, three right; two at 20 mm/s, one right."""
    predictions = table(
        [(10, "a/10", "a", "a"), (10, "a/10", "a", "a"), (10, "b/10", "b", "b"),
         (10, "b/10", "b", "a"), (20, "a/20", "a", "b"), (20, "b/20", "b", "b")]
    )  # fmt: skip
    assert accuracy_by_speed(predictions) == {10.0: 0.75, 20.0: 0.5}
    np.testing.assert_array_equal(confusion(predictions, ["a", "b"]), [[2, 1], [1, 2]])
    assert macro_f1(predictions, ["a", "b"]) == pytest.approx(2 / 3)


def test_perfect_predictions_leave_no_doubt():
    interval = bootstrap_interval(table([(10, "a/10", "a", "a"), (20, "a/20", "a", "a")]))
    assert (interval.low, interval.high) == (1.0, 1.0)


def test_recordings_are_the_unit_not_samples():
    """Two recordings, one all right and one all wrong: however many samples, anything goes."""
    rows = [(10, "a/10", "a", "a")] * 1000 + [(10, "b/10", "b", "a")] * 1000
    interval = bootstrap_interval(table(rows))
    assert (interval.low, interval.high) == (0.0, 1.0)


def test_the_interval_shrinks_with_recordings_and_covers_the_truth():
    rng = np.random.default_rng(0)
    covered = []
    for trial in range(40):
        right = rng.random(100) < 0.7
        rows = [(10, f"r{i}", "a", "a" if r else "b") for i, r in enumerate(right)]
        interval = bootstrap_interval(table(rows), seed=trial)
        assert 0.1 < interval.high - interval.low < 0.25
        covered.append(interval.low <= 0.7 <= interval.high)
    assert np.mean(covered) >= 0.85

"""Intervals that cover the truth, and differences that see what is paired."""

import numpy as np
import pandas as pd
import pytest

from afferents.core.errors import InputError
from afferents.evaluation.bootstrap import Accuracy, bootstrap_interval, paired_difference


def table(rows, seeds=None):
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    predictions = pd.DataFrame(rows, columns=names)
    return predictions if seeds is None else predictions.assign(seed=seeds)


def named(right, speed=10):
    """One sample a recording, named rightly or not."""
    return [(speed, f"r{i:03}", "a", "a" if r else "b") for i, r in enumerate(right)]


def interval(rows, seed=0):
    return bootstrap_interval(Accuracy(table(rows)), seed)


def test_perfect_predictions_leave_no_doubt():
    found = interval([(10, "a/10", "a", "a"), (20, "a/20", "a", "a")])
    assert (found.low, found.high) == (1.0, 1.0)


def test_recordings_are_the_unit_not_samples():
    """Two recordings, one all right and one all wrong: however many samples, anything goes."""
    found = interval([(10, "a/10", "a", "a")] * 1000 + [(10, "b/10", "b", "a")] * 1000)
    assert (found.low, found.high) == (0.0, 1.0)


def test_the_interval_shrinks_with_recordings_and_covers_the_truth():
    rng = np.random.default_rng(0)
    covered = []
    for trial in range(40):
        found = interval(named(rng.random(100) < 0.7), trial)
        assert 0.1 < found.high - found.low < 0.25
        covered.append(found.low <= 0.7 <= found.high)
    assert np.mean(covered) >= 0.85


def test_trainings_that_disagree_widen_the_interval():
    """Three seeds, each right or wrong about everything: recordings alone would show no doubt."""
    rows, seeds = [], []
    for seed, right in enumerate([True, True, False]):
        rows += named([right] * 50)
        seeds += [seed] * 50
    found = bootstrap_interval(Accuracy(table(rows, seeds)))
    assert found.low <= 1 / 3
    assert found.high == 1.0
    assert Accuracy(table(rows, seeds)).mean() == pytest.approx(2 / 3)


def test_the_mean_is_that_of_speeds():
    rows = named([True] * 8) + named([False, False], speed=20)
    assert Accuracy(table(rows)).mean() == 0.5


def test_a_difference_on_the_same_recordings_is_surer_than_the_accuracies():
    rng = np.random.default_rng(1)
    easy = rng.random(60) < 0.5
    better = easy.copy()
    better[np.flatnonzero(~easy)[:6]] = True
    one, other = Accuracy(table(named(better))), Accuracy(table(named(easy)))
    found = paired_difference(one, other)
    assert found.mean == pytest.approx(0.1)
    assert 0 < found.low < 0.1 < found.high
    alone = bootstrap_interval(one)
    assert found.high - found.low < 0.7 * (alone.high - alone.low)
    assert paired_difference(other, one).mean == pytest.approx(-0.1)


def test_a_difference_is_of_the_recordings_that_both_have():
    one = Accuracy(table([*named([True] * 10), (20, "x", "a", "a")]))
    other = Accuracy(table(named([True] * 5)))
    assert paired_difference(one, other).describe() == {"difference": 0.0, "ci95": [0.0, 0.0]}
    with pytest.raises(InputError, match="recordings that both were tested on"):
        paired_difference(one, Accuracy(table([(10, "elsewhere", "a", "a")])))

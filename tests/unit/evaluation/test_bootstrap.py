"""Intervals that cover the truth, and differences that see what is paired."""

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.evaluation.intervals import (
    SESSION,
    TEXTURE,
    Accuracy,
    bootstrap_interval,
    choose_bootstrap_unit,
    count_right,
    intervals_by_group,
    paired_difference,
)
from afferents.evaluation.metrics import accuracy_interval

SPEEDS = (10.0, 20.0, 40.0, 80.0)
WRONG = "none"


def table(rows, seeds=None):
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    predictions = pd.DataFrame(rows, columns=names)
    return predictions if seeds is None else predictions.assign(seed=seeds)


def accuracy_of(rows, seeds=None, unit=TEXTURE):
    return Accuracy(count_right(table(rows, seeds), unit))


def named(right, speed=10.0):
    """One sample a texture, named rightly or not."""
    return [
        (speed, f"t{i:03}/{speed:g}", f"t{i:03}", f"t{i:03}" if r else WRONG)
        for i, r in enumerate(right)
    ]


def samples_of(shares, speeds=SPEEDS, n=10, session=""):
    """Samples of textures that are named rightly in these shares, the same at all speeds."""
    return [
        (speed, f"{session}{i}/{speed:g}", f"t{i}", f"t{i}" if k < round(n * share) else WRONG)
        for i, share in enumerate(shares)
        for speed in speeds
        for k in range(n)
    ]


def interval(rows, seed=0, unit=TEXTURE):
    return bootstrap_interval(accuracy_of(rows, unit=unit), seed)


def width(found):
    return found.high - found.low


def test_textures_are_the_unit_not_samples_nor_recordings():
    """One texture all right, one all wrong: however many samples and speeds, anything goes."""
    found = interval(samples_of([1.0, 0.0], n=100))
    assert (found.low, found.high) == (0.0, 1.0)
    alone, sure = interval(samples_of([0.5])), interval(samples_of([1.0, 1.0]))
    assert (alone.low, alone.high, sure.low, sure.high) == (0.0, 1.0, 1.0, 1.0)


def test_speeds_of_a_texture_stay_together():
    """At ten speeds with the same outcome as at one there is no more to know."""
    shares = [0.2, 0.5, 0.6, 0.9, 1.0, 0.8]
    one, ten = (interval(samples_of(shares, range(10, 10 + n))) for n in (1, 10))
    assert width(one) == pytest.approx(width(ten))


@pytest.mark.parametrize("n", [3, 13])
def test_the_interval_covers_the_truth(n):
    """Textures drawn from all those whose accuracies are evenly spread: their mean is a half."""
    rng = np.random.default_rng(0)
    found = [interval(samples_of(rng.random(n), SPEEDS[:1], 20), trial) for trial in range(80)]
    covered = np.mean([one.low <= 0.5 <= one.high for one in found])
    assert covered >= 0.88  # 95 of 100, with the doubt of 80 trials


def test_the_interval_is_students_t_of_the_textures_means():
    shares = np.array([0.2, 0.5, 0.6, 0.9, 1.0, 0.8])
    found = interval(samples_of(shares))
    half = 2.5706 * shares.std(ddof=1) / np.sqrt(6)
    assert found.low == pytest.approx(shares.mean() - half, abs=0.02)
    assert found.high == pytest.approx(min(1, shares.mean() + half), abs=0.02)


def test_of_several_sessions_the_session_is_the_unit():
    """Textures differ widely and sessions hardly: over sessions the interval is narrow."""
    shares = np.array([0.1, 0.9] * 6)
    rows = [
        row
        for session, off in enumerate((-0.05, 0.0, 0.05), start=1)
        for row in samples_of(shares + off, n=20, session=f"{session}:")
    ]
    over_sessions, over_textures = interval(rows, unit=SESSION), interval(rows)
    half = 4.3027 * 0.05 / np.sqrt(3)
    assert over_sessions.low == pytest.approx(0.5 - half, abs=0.02)
    assert width(over_textures) > 1.5 * width(over_sessions)
    assert len(accuracy_of(rows, unit=SESSION).units) == 3


def test_a_texture_that_lacks_a_speed_is_left_out_there():
    rows = samples_of([0.5, 0.7, 0.9], (10.0,)) + samples_of([0.5, 0.7], (20.0,))
    accuracy = accuracy_of(rows)
    assert accuracy.mean() == pytest.approx(0.65)
    assert np.isfinite(accuracy.resampled()).all()
    assert all(0 <= one.low <= one.high <= 1 for one in intervals_by_group(accuracy).values())


def test_trainings_that_disagree_widen_the_interval():
    """Three seeds, each right or wrong about everything: textures alone would show no doubt."""
    rows, seeds = [], []
    for seed, right in enumerate([True, True, False]):
        rows += named([right] * 50)
        seeds += [seed] * 50
    found = bootstrap_interval(accuracy_of(rows, seeds))
    assert found.low <= 1 / 3
    assert found.high == 1.0
    assert accuracy_of(rows, seeds).mean() == pytest.approx(2 / 3)


def test_a_difference_on_the_same_textures_is_surer_than_the_accuracies():
    rng = np.random.default_rng(1)
    easy = rng.random(60) < 0.5
    better = easy.copy()
    better[np.flatnonzero(~easy)[:6]] = True
    one, other = accuracy_of(named(better)), accuracy_of(named(easy))
    found = paired_difference(one, other)
    low, high = found.ci95
    assert found.difference == pytest.approx(0.1)
    assert 0 < low < 0.1 < high
    alone = bootstrap_interval(one)
    assert high - low < 0.7 * width(alone)
    assert paired_difference(other, one).difference == pytest.approx(-0.1)
    with pytest.raises(InputError, match="recordings that both were tested on"):
        paired_difference(one, accuracy_of([(10, "elsewhere", "a", "a")]))


def test_sessions_are_drawn_where_each_group_was_tested_in_several():
    first, second = (samples_of([0.5, 0.8], session=f"{n}:") for n in (1, 2))
    assert choose_bootstrap_unit(2, table(first + second)) == SESSION
    assert choose_bootstrap_unit(2, table(first)) == TEXTURE  # the other was learnt from alone
    apart = [*samples_of([0.5], (10.0,), session="1:"), *samples_of([0.5], (20.0,), session="2:")]
    assert choose_bootstrap_unit(2, table(apart)) == TEXTURE  # a session is a group
    assert choose_bootstrap_unit(1, table(first)) == TEXTURE


def test_an_interval_is_a_function_of_what_is_named():
    y, speeds = np.tile(list("abc"), 4), (10, 20, 40, 80)
    speed = np.repeat(speeds, 3)
    found = accuracy_interval(y, np.where(speed == 80, "a", y), speed)
    assert found.mean_accuracy == pytest.approx(10 / 12)
    assert found.ci95[0] < 10 / 12 < found.ci95[1]
    assert found.by["80"] == pytest.approx(1 / 3)
    days = accuracy_interval(y, y, 20240100 + speed)  # numbers of more digits than a speed has
    assert list(days.by) == ["20240110", "20240120", "20240140", "20240180"]
    with pytest.raises(InputError, match=r"y, predicted, groups: .*found 12, 11, 12"):
        accuracy_interval(y, y[1:], speed)

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st
from sklearn.linear_model import LogisticRegression

from afferents import Model, evaluate
from afferents.errors import AfferentsError, LeakageError
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import (
    LeaveOneSpeedOut,
    find_leaks,
    overlapping,
    refuse_leaks,
)
from afferents.models.fitted import Fitted, predict_alone
from afferents.models.orders import OrderSearch

NONE = np.empty(0, dtype=int)


def folds(data, protocol):
    return list(LeaveOneSpeedOut(PROTOCOLS[protocol]).folds(data))


def test_nested_folds_leak_nothing(samples):
    data = samples((10, 20, 30), overlap=0.5)
    for fold in folds(data, "nested"):
        refuse_leaks(find_leaks(data, fold, fold.train), fold)


def test_published_leaks_are_counted(samples):
    data = samples((10, 20, 30), n=6, overlap=0.5)
    fold = folds(data, "published")[0]
    leaks = find_leaks(data, fold, np.arange(len(data)))
    assert leaks.test_samples_of_a_group_seen_in_validation == 6
    assert leaks.test_samples_overlapping_validation == 6
    assert leaks.test_samples_overlapping_training == 0
    assert leaks.scale_saw_held_out_group
    touching = samples((10, 20, 30), overlap=0.0)
    leaks = find_leaks(touching, folds(touching, "published")[0], NONE)
    assert leaks.test_samples_overlapping_validation == 0
    assert leaks.test_samples_of_a_group_seen_in_validation == 6


def test_a_scaler_that_saw_the_held_out_speed_is_refused(samples):
    data = samples((10, 20, 30))
    fold = folds(data, "nested")[0]
    leaks = find_leaks(data, fold, np.concatenate([fold.train, fold.test[:1]]))
    with pytest.raises(LeakageError, match="scale_saw_held_out_speed True"):
        refuse_leaks(leaks, fold)


@pytest.mark.parametrize("part", ["train", "validation"])
def test_a_test_sample_planted_elsewhere_is_refused(samples, part):
    data = samples((10, 20, 30))
    fold = folds(data, "nested")[1]
    planted = np.append(getattr(fold, part), fold.test[3])
    broken = dataclasses.replace(fold, **{part: planted})
    with pytest.raises(LeakageError, match="20 mm/s"):
        refuse_leaks(find_leaks(data, broken, NONE), broken)


spans = st.lists(st.tuples(st.integers(0, 50), st.integers(1, 10)), max_size=15)


@settings(max_examples=200)
@given(spans, spans)
def test_overlaps_agree_with_looking_at_every_pair(mine, others):
    start, length = np.array([*mine, *others], dtype=float).reshape(-1, 2).T
    tested, learnt = np.split(np.arange(len(start)), [len(mine)])
    extent = {"start_s": start, "stop_s": start + length}
    samples = xr.Dataset({name: ("sample", its) for name, its in extent.items()})
    samples["recording"] = ("sample", np.full(len(start), "1/20"))
    expected = sum(
        any(start[j] < start[i] + length[i] and start[j] + length[j] > start[i] for j in learnt)
        for i in tested
    )
    assert overlapping(samples, tested, learnt) == expected


class GoesByTheTest(LogisticRegression):
    """Takes the mean of whatever it is asked together: it learns from the samples tested."""

    def predict_proba(self, values):
        return super().predict_proba(values - values.mean(axis=0))


class AsksForTheSpeed(OrderSearch):
    """Is told by nobody, and asks all the same."""

    name = "asks-for-the-speed"

    def scores(self, values, speed_mm_s=None):
        return super().scores(values) + 0 * speed_mm_s.sum()


class SaysNoNumbers(OrderSearch):
    name = "says-no-numbers"

    def scores(self, values, speed_mm_s=None):
        return super().scores(values) * np.nan


@pytest.mark.parametrize(
    ("encoding", "classifier", "error", "sentence"),
    [
        (
            "spectral",
            GoesByTheTest(),
            LeakageError,
            "the same probabilities of a test sample whatever else is tested",
        ),
        ("orders", SaysNoNumbers, AfferentsError, "found some that are infinite or no numbers"),
        ("orders", AsksForTheSpeed, AfferentsError, "NoneType"),
    ],
)
def test_a_model_that_goes_by_what_is_tested_or_says_no_numbers_is_refused(
    stores, tmp_path, encoding, classifier, error, sentence
):
    mine = Model("mine", channel="ra2", encoding=encoding, classifier=classifier)
    with pytest.raises(error, match=sentence):
        evaluate(stores["audio"], tmp_path / "r", mine, window_s=1, quiet=True, workers=1)


def test_a_model_of_ones_own_that_does_not_is_kept(stores, tmp_path):
    honest = Model("honest", channel="ra2", encoding="spectral", classifier=LogisticRegression())
    found = evaluate(stores["audio"], tmp_path / "q", honest, quiet=True, workers=1)
    facts = next((tmp_path / "q").rglob("fold.json"))
    assert json.loads(facts.read_text())["prediction_ms"] > 0
    assert not any(found.summary["models"]["honest"]["nested"]["leaks"].values())


def test_what_rounding_does_to_samples_that_are_all_alike_is_no_leak():
    probabilities = np.full((8, 2), 0.5, np.float32)
    fitted = Fitted(None, probabilities, None, {}, lambda index: probabilities[index] + 1e-7)
    assert predict_alone("silence", fitted, np.arange(8))["prediction_ms"] >= 0

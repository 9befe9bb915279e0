"""What is counted: accuracies, recordings and touches named by their samples, reliability."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from afferents.evaluation import metrics


def table(rows):
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    return pd.DataFrame(rows, columns=names)


def test_by_hand():
    """Four samples at 10 mm/s, three right; two at 20 mm/s, one right."""
    predictions = table(
        [(10, "a/10", "a", "a"), (10, "a/10", "a", "a"), (10, "b/10", "b", "b"),
         (10, "b/10", "b", "a"), (20, "a/20", "a", "b"), (20, "b/20", "b", "b")]
    )  # fmt: skip
    assert metrics.accuracy_by_group(predictions) == {10.0: 0.75, 20.0: 0.5}
    np.testing.assert_array_equal(metrics.confusion(predictions, ["a", "b"]), [[2, 1], [1, 2]])
    assert metrics.macro_f1(predictions, ["a", "b"]) == pytest.approx(2 / 3)


def predictions(rows):
    table = pd.DataFrame(
        rows, columns=["held_out_speed_mm_s", "recording", "true_texture", "p_a", "p_b"]
    )
    return table.assign(seed=0, predicted_texture=np.where(table.p_a > table.p_b, "a", "b"))


def test_one_sure_sample_outweighs_two_that_waver():
    table = predictions(
        [(10, "r", "a", 0.99, 0.01), (10, "r", "a", 0.4, 0.6), (10, "r", "a", 0.4, 0.6)]
    )
    named = metrics.name_recordings(table, ["a", "b"])
    assert list(named["predicted_texture"]) == ["a"]
    assert list(named["true_texture"]) == ["a"]
    sure = metrics.name_recordings(predictions([(10, "r", "b", 0.0, 1.0)]), ["a", "b"])
    assert list(sure["predicted_texture"]) == ["b"]
    table = predictions([(v, f"{v}/{r}", "a", 0.9, 0.1) for v in (10, 20) for r in "xyz"])
    assert len(metrics.name_recordings(pd.concat([table, table.assign(seed=1)]), ["a", "b"])) == 12


def test_between_leaves_out_slowest_and_fastest():
    table = predictions([(v, "r", "a", 1, 0) for v in (10, 20, 30, 40)])
    assert sorted(metrics.inside_speeds(table)["held_out_speed_mm_s"]) == [20, 30]


def samples(recording, speed, lasting_s, stride_s, p_a):
    """Samples of texture a in a row, and the probability that each gives it."""
    start_s = 3 + stride_s * np.arange(len(p_a))
    rows = [(speed, recording, "a", p, 1 - p) for p in p_a]
    return predictions(rows).assign(start_s=start_s, stop_s=start_s + lasting_s)


@pytest.mark.parametrize(
    ("lasting_s", "stride_s", "touch_s", "n", "seconds"),
    [
        (1 / 90, 1 / 90, 0.11, 10, 1 / 9),  # single frames
        (1 / 9, 1 / 9, 0.11, 1, 1 / 9),  # runs of ten
        (11 / 90, 1 / 9, 1, 9, 91 / 90),  # runs of ten, with a frame before
        (1, 0.5, 1, 1, 1),  # the paper's windows of vibration
        (1, 0.5, 4, 7, 4),
        (4, 2, 4, 1, 4),
        (4, 2, 1, None, None),  # longer than the touch
        (4, 2, 0.11, None, None),
        (1 / 60, 1 / 60, 0.11, 7, 7 / 60),  # another camera
    ],
)
def test_a_touch_is_as_many_samples_as_come_nearest(lasting_s, stride_s, touch_s, n, seconds):
    table = samples("r", 10, lasting_s, stride_s, [0.9] * 500)
    found = metrics.name_touches(table, ["a", "b"], touch_s)
    assert (found is None) == (n is None)
    if found is not None:
        assert (found.samples, found.seconds) == (n, pytest.approx(seconds))
        assert len(found.named) == 500 // n


def test_a_touch_is_named_by_its_own_samples_together():
    table = samples("r", 10, 0.5, 0.5, [0.99, 0.4, 0.3, 0.6, 0.3, 0.9, 0.1])
    found = metrics.name_touches(table, ["a", "b"], 1)
    assert list(found.named["predicted_texture"]) == ["a", "b", "a"], "the seventh is left over"
    both = pd.concat([table, table.assign(recording="s")]).sample(frac=1, random_state=0)
    assert len(metrics.name_touches(both, ["a", "b"], 1).named) == 6, "whatever the order"
    assert (
        len(metrics.name_touches(pd.concat([table, table.assign(seed=1)]), ["a", "b"], 1).named)
        == 6
    )


def test_a_speed_of_short_recordings_has_no_long_touches():
    table = pd.concat([samples("r", 10, 1, 1, [0.9] * 8), samples("s", 20, 1, 1, [0.9] * 3)])
    assert metrics.name_touches(table, ["a", "b"], 4) is None
    assert len(metrics.name_touches(table, ["a", "b"], 1).named) == 11
    longer = pd.concat([table, samples("t", 20, 1, 1, [0.9] * 4)])
    assert sorted(metrics.name_touches(longer, ["a", "b"], 4).named["recording"]) == ["r", "r", "t"]


def test_a_touch_goes_over_no_gap():
    table = samples("r", 10, 0.25, 0.25, [0.9] * 12)
    gone = table.drop(index=[3, 4, 5])  # 0.75 s, a gap, then 1.5 s
    assert [len(metrics.name_touches(t, ["a", "b"], 1).named) for t in (table, gone)] == [3, 1]


def test_a_touch_of_samples_that_lie_unevenly_is_left_out_where_it_is_too_long():
    table = samples("r", 10, 0.5, 0.5, [0.9] * 12)
    steps = np.array([0.5] * 4 + [0.74] * 3 + [0.5] * 4)  # the second four last 2.7 s, not 2
    table["start_s"] = 3 + np.concatenate([[0], steps.cumsum()])
    found = metrics.name_touches(table.assign(stop_s=table.start_s + 0.5), ["a", "b"], 2)
    assert (len(found.named), found.seconds) == (2, pytest.approx(2))


def test_who_always_names_one_texture():
    rows = [(v, f"{t}/{v}", t, 1, 0) for v in (10, 20) for t in "ab" for _ in range(3)]
    assert metrics.chance_accuracy(predictions(rows)) == 0.5
    more = predictions([*rows, (10, "c/10", "b", 1, 0), (20, "c/20", "b", 1, 0)])
    assert metrics.chance_accuracy(more) == pytest.approx(2 / 3)
    more.index = pd.Index([0] * len(more))  # as the tables of folds are joined
    assert metrics.chance_accuracy(more) == pytest.approx(2 / 3)


def test_reliability_by_hand():
    """Two of four right at 0.5 and 0.6, one bin; one right at 0.9, another."""
    found = metrics.reliability(
        np.array([0.5, 0.6, 0.5, 0.6, 0.9]), np.array([1, 0, 1, 0, 1], bool), 2
    )
    # 0.5 belongs to the lower bin: both right; above it one of three right.
    assert found.count == (2, 3)
    np.testing.assert_allclose(found.confidence, [0.5, 0.7])
    np.testing.assert_allclose(found.accuracy, [1, 1 / 3])
    assert found.ece == pytest.approx((2 * 0.5 + 3 * (0.7 - 1 / 3)) / 5)


def test_predictions_without_probabilities_say_nothing():
    rows = pd.DataFrame({"true_texture": ["a", "b"], "predicted_texture": ["a", "a"]})
    assert metrics.measure_reliability(rows) is None
    found = metrics.measure_reliability(rows.assign(p_a=[0.8, 0.8], p_b=[0.2, 0.2]))
    assert found.ece == pytest.approx(0.3)


shares = st.floats(0, 1, width=32)


@given(st.integers(1, 50).flatmap(lambda n: st.tuples(
    arrays(np.float32, n, elements=shares), arrays(bool, n)
)), st.integers(1, 20))  # fmt: skip
def test_every_sample_is_in_a_bin_and_the_error_is_a_share(drawn, n_bins):
    confidence, right = drawn
    found = metrics.reliability(confidence, right, n_bins)
    assert sum(found.count) == len(confidence)
    assert np.dot(found.count, found.accuracy) == pytest.approx(right.sum())
    total = confidence.sum(dtype=float)
    assert np.dot(found.count, found.confidence) == pytest.approx(total, abs=1e-6)
    assert 0 <= found.ece <= 1

"""Spikes are held, cut, stretched and refused as they must be."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from afferents.errors import InputError
from afferents.spikes import Spikes
from afferents.spikes.population import joined

# any times are drawn here
pytestmark = pytest.mark.filterwarnings("ignore:.*refractory time:UserWarning")
UNITS = {"name": ["a", "b", "c"], "class": ["SA", "RA", "PC"]}


def population(trains, duration_s=1.0, units=UNITS):
    n = len(trains)
    trials = {
        "texture": [str(i) for i in range(n)],
        "speed_mm_s": [20.0 * (i + 1) for i in range(n)],
    }
    return Spikes.from_trains(trains, units, {**trials, "duration_s": [duration_s] * n})


times = st.lists(st.floats(0.01, 1), max_size=6).map(sorted)
rows = st.lists(st.tuples(times, times, st.none() | times), min_size=1, max_size=4)


@given(rows)
def test_trains_come_back_as_they_went_in(trains):
    spikes = population(trains)
    for t, row in enumerate(trains):
        for u, train in enumerate(row):
            np.testing.assert_array_equal(spikes.train(t, u), train or [])
            assert spikes.recorded[t, u] == (train is not None)


@given(rows)
def test_what_is_selected_and_joined_again_is_the_same(trains):
    spikes = population(trains)
    parts = joined(spikes.select(trials=[t]) for t in range(spikes.n_trials))
    np.testing.assert_array_equal(parts.times, spikes.times)
    np.testing.assert_array_equal(parts.offsets, spikes.offsets)
    fine, coarse = (replace(spikes, units=spikes.units.assign(resolution_s=s)) for s in (0, 0.1))
    assert joined([fine, coarse]).units["resolution_s"].tolist() == [0.1] * 3
    backwards = spikes.select(units=[2, 0])
    assert list(backwards.units.index) == ["c", "a"]
    for t in range(spikes.n_trials):
        np.testing.assert_array_equal(backwards.train(t, 0), spikes.train(t, 2))


@given(rows, st.sampled_from([0.1, 0.25, 1.0]))
def test_bins_hold_every_spike_once(trains, width_s):
    spikes = population(trains, duration_s=1.1)
    binned = spikes.binned(width_s, stop_s=1.0)
    for t in range(spikes.n_trials):
        for u in range(3):
            expected = np.sum(spikes.train(t, u) < width_s * binned.sizes["time"])
            if spikes.recorded[t, u]:
                assert binned.values[t, u].sum() == expected
            else:
                assert np.isnan(binned.values[t, u]).all()


def test_windows_and_stretches():
    spikes = population([([0.1, 0.5, 0.9], [0.5], None)])
    late = spikes.window(0.5, 1.0)
    np.testing.assert_allclose(late.train(0, 0), [0.0, 0.4])
    assert late.trials["duration_s"].tolist() == [0.5]
    slow = spikes.stretched(2.0)
    np.testing.assert_allclose(slow.train(0, 0), [0.2, 1.0, 1.8])
    np.testing.assert_allclose(slow.rates()[0], [1.5, 0.5, np.nan])
    assert spikes.of_class("PC", "SA").units.index.tolist() == ["a", "c"]


def test_each_train_has_its_own_duration():
    """What all trains of a trial last is the shortest; rates are each over its own."""
    units = {"name": ["a", "b", "c"], "class": ["SA"] * 3}
    trials = {"texture": ["1", "2"]}
    trains = [[[0.1, 0.4], [0.1, 0.7], None], [None, [0.2], [0.2]]]
    given = {"durations_s": [[0.5, 0.8, 0.1], [np.nan, 0.8, 2.0]]}
    spikes = Spikes.from_trains(trains, units, trials, **given)
    np.testing.assert_allclose(spikes.rates(), [[4, 2.5, np.nan], [np.nan, 1.25, 0.5]])
    assert spikes.trials["duration_s"].tolist() == [0.5, 0.8]
    assert spikes.select(units=[1]).trials["duration_s"].tolist() == [0.8, 0.8]
    assert spikes.select(units=[2]).trials["duration_s"].tolist() == [0.5, 2.0]
    np.testing.assert_allclose(spikes.stretched(2.0).rates()[0, :2], [2, 1.25])
    np.testing.assert_allclose(spikes.window(0, 0.5).counts()[0, :2], [2, 1])
    same = joined(spikes.select(trials=[t]) for t in range(2))
    np.testing.assert_array_equal(same.durations_s, spikes.durations_s)
    for wrong in (0.3, [[0.5, np.nan, 1], [1, 1, 1]], [1, 2]):
        with pytest.raises(InputError, match=r"within the trial|a positive duration|2 trials x 3"):
            Spikes.from_trains(trains, units, trials, durations_s=wrong)
    with pytest.raises(InputError, match=r"how long trials last, .* or each train its own"):
        Spikes.from_trains(trains, units, trials)


def test_units_whose_trains_all_end_early_are_warned_of():
    """At one speed: of two units, one was recorded for half a second of the 0.8 s given."""
    rng = np.random.default_rng(0)
    ends = {20.0: (2.0, 2.0), 40.0: (0.5, 0.8)}
    trials = [(str(n), speed) for n in range(4) for speed in ends]
    trains = [[np.sort(rng.uniform(0, end, 12)) for end in ends[speed]] for _, speed in trials]
    table = {
        "texture": [name for name, _ in trials],
        "speed_mm_s": [speed for _, speed in trials],
        "duration_s": [max(ends[speed]) for _, speed in trials],
    }
    units = {"name": ["a", "b"], "class": ["SA"] * 2}
    with pytest.warns(UserWarning, match=r"of 1 of 2 units \(a\) reaches .* at 40 mm/s:"):
        Spikes.from_trains(trains, units, table)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        right = [ends[speed] for _, speed in trials]
        Spikes.from_trains(trains, units, table, durations_s=right)


@pytest.mark.parametrize(
    ("trains", "units", "said"),
    [
        ([([0.3, 0.1], [], [])], UNITS, "ascending order, found 0.1 s in trial 0 of unit a"),
        ([([], [-0.1], [])], UNITS, "times of 0 s or more"),
        ([([np.nan], [], [])], UNITS, "finite times"),
        ([([100.0, 250.0], [300.0], [])], UNITS, "if times are in ms, divide them by 1000"),
        ([([0.1, 0.2, 1.5], [0.3], [])], UNITS, "1 spikes lie beyond"),
        ([([0.1], [0.3])], UNITS, "trains of 1 trials of 3 units"),
        ([([], [], [])], {"name": ["a", "b", "c"]}, "a column 'class'"),
        ([([], [], [])], {"name": ["a", "a", "b"], "class": ["SA"] * 3}, "two of the name 'a'"),
        ([([], [], [])], {"name": ["a", "b", "c"], "class": ["SA", "RA", "SAI"]}, "'SAI'"),
    ],
)
def test_spikes_that_cannot_be_are_refused(trains, units, said):
    with pytest.raises(InputError, match=said):
        population(trains, units=units)

"""Spikes as Neo has them, and back."""

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.neuro.neo import from_neo, to_neo
from afferents.spikes import Spikes

neo = pytest.importorskip("neo")


@pytest.fixture
def spikes():
    units = {
        "name": ["a", "b", "c"],
        "class": ["SA", "RA", "PC"],
        "resolution_s": [0.01, 0, 0],
        "receptive_field": [(0,), (1, 2), ()],
    }
    trials = {
        "texture": ["1", "2"],
        "speed_mm_s": [40, 80],
        "duration_s": [1, 0.5],
        "force": [1, 2],
    }
    trains = [[[0.1, 1.0], [], [0.5]], [[0.25], None, [0.0]]]
    durations_s = [[1, 1, 0.75], [0.5, 0.5, 0.5]]
    return Spikes.from_trains(trains, units, trials, durations_s=durations_s)


def test_segments_are_trials_and_trains_are_units(spikes):
    block = to_neo(spikes)
    assert [segment.annotations["texture"] for segment in block.segments] == ["1", "2"]
    assert [train.name for train in block.segments[1].spiketrains] == ["a", "c"]
    train = block.segments[0].spiketrains[0]
    assert train.annotations["class"] == "SA"
    np.testing.assert_allclose(train.rescale("ms").magnitude, [100, 1000])
    assert float(train.t_stop) == 1.0


def test_they_come_back_as_they_went_in(spikes):
    found = from_neo(to_neo(spikes))
    np.testing.assert_array_equal(found.times, spikes.times)
    np.testing.assert_array_equal(found.offsets, spikes.offsets)
    np.testing.assert_array_equal(found.durations_s, spikes.durations_s)
    pd.testing.assert_frame_equal(found.units, spikes.units)
    pd.testing.assert_frame_equal(found.trials[list(spikes.trials)], spikes.trials)


def test_units_keep_their_order_and_trials_any_condition():
    units = {"name": ["a", "b"], "class": ["SA", "RA"], "resolution_s": [0, 0]}
    trials = {"texture": ["1", "2"], "duration_s": [1, 1], "name": ["dry", "wet"]}
    trains = [[None, [0.5]], [[0.25], [0.1]]]
    found = from_neo(to_neo(Spikes.from_trains(trains, units, trials)))
    assert found.units.index.tolist() == ["a", "b"]
    assert found.trials["name"].tolist() == ["dry", "wet"]


def test_blocks_of_others():
    segment = neo.Segment(texture="silk")
    train = neo.SpikeTrain([1100.0], units="ms", t_start=1000.0, t_stop=2000.0, name="n")
    segment.spiketrains.append(train)
    block = neo.Block()
    block.segments.append(segment)
    with pytest.raises(InputError, match="a column 'class' of units"):
        from_neo(block)
    train.annotate(**{"class": "PC"})
    found = from_neo(block)
    np.testing.assert_allclose(found.train(0, 0), [0.1])
    assert found.trials["duration_s"].tolist() == [1.0]
    segment.annotate(duration_s=7.0)
    late = {"t_start": 1.2, "t_stop": 1.5, "name": "late", "class": "SA"}
    segment.spiketrains.append(neo.SpikeTrain([1.25], units="s", **late))
    found = from_neo(block)  # trains keep their places in the trial, and their ends
    np.testing.assert_allclose([found.train(0, 0), found.train(0, 1)], [[0.1], [0.25]])
    np.testing.assert_allclose(found.durations_s, [[1.0, 0.5]])


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ((None,), "found one without"),
        (("",), "found one without"),
        (("n", "n"), "found two .* 'n'"),
    ],
)
def test_trains_that_names_do_not_tell_apart_are_refused(names, said):
    segment, block = neo.Segment(texture="silk"), neo.Block()
    for name in names:
        segment.spiketrains.append(neo.SpikeTrain([0.5], units="s", t_stop=1.0, name=name))
    block.segments.append(segment)
    with pytest.raises(InputError, match=said):
        from_neo(block)

"""Two populations are made alike in everything that makes reading easier."""

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.neuro.beside import alike, matched
from afferents.spikes import Spikes


def made(textures, speeds, classes, seconds):
    trials = pd.DataFrame(
        [(f"t{t}", v) for t in range(textures) for v in speeds], columns=["texture", "speed_mm_s"]
    ).assign(duration_s=seconds)
    trains = [[np.arange(0.05, seconds, 0.1)] * len(classes)] * len(trials)
    return Spikes.from_trains(trains, {"name": range(len(classes)), "class": classes}, trials)


def test_as_many_of_everything_as_both_have():
    rig = made(13, (10, 20, 30, 60, 90, 100), ["SA"] * 20 + ["RA"] * 20 + ["PC"] * 8, 20.0)
    nerve = made(55, (40, 80, 120), ["SA"] * 17 + ["PC"] * 7, 1.5)
    for one in matched(rig, nerve):
        assert one.trials["texture"].nunique() == 13
        assert one.units["class"].value_counts().to_dict() == {"SA": 17, "PC": 7}
        assert one.trials["duration_s"].unique() == [1.5]
    speeds = [sorted(one.trials["speed_mm_s"].unique()) for one in matched(rig, nerve)]
    assert speeds == [[30, 60, 90], [40, 80, 120]]


def test_speeds_are_chosen_by_their_ratios():
    here, there = alike(np.array([10.0, 25.0, 50.0, 100.0]), np.array([40.0, 80.0]))
    assert here.tolist() == [50.0, 100.0]
    assert there.tolist() == [40.0, 80.0]


def test_populations_of_nothing_in_common_are_refused():
    with pytest.raises(InputError, match="found SA and PC"):
        matched(made(3, (40, 80), ["SA"], 1.0), made(3, (40, 80), ["PC"], 1.0))

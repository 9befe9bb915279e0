import json
from pathlib import PurePosixPath

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st

from afferents.encodings.samples import make_samples
from afferents.errors import InputError
from afferents.folds.held_out import SPEED, folder_name, order, split_named


def recording(name, speed=20.0, **conditions):
    attrs = {"name": name, "texture": "1", "speed_mm_s": speed}
    return xr.Dataset(attrs=attrs | {"conditions": json.dumps(conditions)})


def test_groups_of_speeds_are_numbers_in_order():
    several = [recording("a", 100.0), recording("b", 20.0), recording("c", 100.0)]
    assert SPEED.groups_of(several) == [20.0, 100.0]
    assert SPEED.printed(12.5) == "12.5 mm/s"


@pytest.mark.parametrize("split", [SPEED, split_named("speed,trial")])
def test_speeds_that_are_nearly_the_same_are_refused(split):
    speeds = (20.0, 49.8, 50.1)
    several = [recording(f"{v}", v, trial=1) for v in speeds]
    with pytest.raises(InputError, match=r"2% or more, found 49\.8 and 50\.1 mm/s"):
        split.groups_of(several)
    assert len(split.groups_of(several[:2])) == 2


def test_groups_of_a_condition_are_texts_in_natural_order():
    trial = split_named("trial")
    several = [
        recording(str(k), trial=value) for k, value in enumerate((10, "2", 2.0, 1, "b", "a"))
    ]
    assert trial.groups_of(several) == ["1", "2", "10", "a", "b"]
    assert (trial.printed("2"), trial.at(["1", "2"])) == ("trial 2", "with trial 1, 2")
    assert split_named("age").one == "an age"


@pytest.mark.parametrize(
    ("recordings", "said"),
    [
        ([recording("a"), recording("b")], r"carry \(none\), found 'trial', which 2 of 2 lack"),
        (
            [recording("a", trial=1, day=1), recording("b", day=1), recording("c", day=2)],
            r"carry \(day\), found 'trial', which 2 of 3 lack, such as b",
        ),
        ([recording("a", trial="")], "recording a: expected a trial of 1 to 80 characters"),
        ([recording("a", trial="x" * 81)], "of 1 to 80 characters"),
    ],
)
def test_a_condition_that_not_all_carry_is_refused(recordings, said):
    with pytest.raises(InputError, match=said):
        split_named("trial").groups_of(recordings)


@pytest.mark.parametrize("name", ["", "a/b", "../x", "texture", " trial"])
def test_what_can_be_no_condition_is_refused(name):
    with pytest.raises(InputError, match="--split"):
        split_named(name)


def test_samples_are_labelled_by_their_recording():
    ends = np.array([0.0, 1.0])
    parts = [
        make_samples(np.zeros((2, 1), np.float32), ("x",), ends, ends + 1, one.attrs)
        for one in (recording("a", trial=1), recording("b", trial="long"))
    ]
    samples = xr.concat(parts, "sample", combine_attrs="drop")
    trial = split_named("trial")
    both = [recording("b", trial="long"), recording("a", trial=1)]
    assert trial.of(trial.labelled(samples, both)).tolist() == ["1", "1", "long", "long"]
    assert SPEED.labelled(samples, both) is samples


@given(st.lists(st.text(min_size=1, max_size=12), unique=True, min_size=2, max_size=8))
def test_each_group_has_a_folder_of_its_own_and_none_is_a_mark(groups):
    names = [folder_name(group) for group in groups]
    assert len(set(names)) == len(groups)
    for name in names:
        assert PurePosixPath(name).name == name
        assert "." not in name
    backwards = groups[::-1]
    assert sorted(groups, key=order) == sorted(backwards, key=order)

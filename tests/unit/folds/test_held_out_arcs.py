"""Arcs of the drum: of which a sample is, and what can't be held out."""

import json

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.samples import concatenate, make_samples
from afferents.errors import InputError
from afferents.folds.held_out import split_named
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneGroupOut, find_leaks, refuse_leaks
from afferents.store.drum_path import CONTACT_MM, MARK, Drum, DrumPath

ROUND_MM = 250.0
ANGLE = split_named("angle")


def recording(name, speed, seconds=6.0, start_mm=0.0, zero=MARK, texture="1"):
    time = np.arange(0, seconds + 0.01, 0.02)
    way = DrumPath(
        Drum(circumference_mm=ROUND_MM, contact_mm=CONTACT_MM, zero=zero),
        time,
        start_mm + speed * time,
    )
    attrs = {"name": name, "texture": texture, "speed_mm_s": abs(speed)}
    steady = json.dumps([0.0, seconds])
    return xr.Dataset({"drum_position": way.variable()}, attrs={**attrs, "steady_s": steady})


def samples_of(recordings, window_s=0.1):
    parts = []
    for responses in recordings:
        start = np.arange(0, 6.0 - window_s, 0.05)
        values = np.zeros((len(start), 1), np.float32)
        parts.append(make_samples(values, ("frequency",), start, start + window_s, responses.attrs))
    return concatenate(parts)


@pytest.fixture(scope="module")
def several():
    return [
        recording(f"{texture}/{speed}", speed, start_mm=70.0 * n, texture=texture)
        for n, texture in enumerate("ab")
        for speed in (50, 80, -100)
    ]


def touched(samples, recordings):
    """Every tenth of a mm of the drum that the skin touched, for each sample, as numbers."""
    found = []
    by_name = {r.attrs["name"]: r for r in recordings}
    columns = ("recording", "start_s", "stop_s")
    for name, *ends in zip(*(samples[c].values.tolist() for c in columns), strict=True):
        drum = by_name[name]["drum_position"]
        ends = np.sort(np.interp(ends, drum["drive_time"], drum))
        way = np.arange(ends[0] - CONTACT_MM / 2, ends[1] + CONTACT_MM / 2, 0.1)
        found.append(set(np.floor(way % ROUND_MM * 10).astype(int).tolist()))
    return found


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_no_bump_is_touched_by_test_and_training(several, protocol):
    samples = ANGLE.labelled(samples_of(several), several)
    assert ANGLE.groups_of(several) == list("12345")
    skin = touched(samples, several)
    for fold in LeaveOneGroupOut(PROTOCOLS[protocol], what=ANGLE).folds(samples):
        learnt = set().union(*(skin[i] for i in fold.train))
        assert not any(skin[i] & learnt for i in fold.test)
        speeds = {*samples["speed_mm_s"].values[fold.test].tolist()}
        assert speeds == {50.0, 80.0, 100.0}
        leaks = find_leaks(samples, fold, fold.train)
        if protocol == "nested":
            chosen = set().union(*(skin[i] for i in fold.validation))
            assert not any(skin[i] & chosen for i in fold.test)
            refuse_leaks(leaks, fold)
        else:
            assert leaks.test_samples_of_a_group_seen_in_validation == len(fold.test)


def test_a_sample_is_of_the_arc_that_holds_all_it_touched():
    one = [recording("1/50", 50)]
    found = ANGLE.labelled(samples_of(one), one)
    centre = 50 * (found["start_s"].values + 0.05)
    assert found["group"].values.tolist() == [str(int(mm % 250 // 50) + 1) for mm in centre]
    # An arc is 50 mm; a sample takes 5 mm of way and 16 mm of contact: 29 mm are left of 50.
    assert len(found) / len(samples_of(one)) == pytest.approx(29 / 50, abs=0.05)


def test_a_mark_on_the_drum_is_at_the_same_place_however_often_it_turned():
    near, far = recording("1/50", 50), recording("1/51", 50, start_mm=1e6 * ROUND_MM)
    of = [ANGLE.labelled(samples_of([r]), [r])["group"].values.tolist() for r in (near, far)]
    assert of[0] == of[1]


ONE = [recording("1/50", 50)]


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (
            lambda: ANGLE.groups_of([xr.Dataset(attrs={"name": "1/9", "texture": "1"})]),
            "found none logged for 1/9",
        ),
        (
            lambda: ANGLE.groups_of([recording("1/40", 40)]),
            "turns at least once in each recording, found 0.96 turns",
        ),
        (
            lambda: ANGLE.groups_of([recording(f"1/{v}", v, zero=str(v)) for v in (50, 60)]),
            "1/50 and 1/60, between which the drive was opened again",
        ),
        (
            lambda: ANGLE.labelled(samples_of(ONE, window_s=1.0), ONE),
            "less than an arc, which is 50.0 mm long, found 66.0 mm",
        ),
        (
            lambda: ANGLE.labelled(samples_of(ONE).isel(sample=slice(0, 40)), ONE),
            "every texture in every group, found none of 1 in arc 3",
        ),
        (lambda: split_named("angle-1").groups_of([]), "2 to 99 arcs, found 'angle-1'"),
    ],
)
def test_what_can_not_be_held_out_is_refused(ask, said):
    with pytest.raises(InputError) as error:
        ask()
    assert said in str(error.value)


def without(responses, first_s, last_s):
    time = responses["drive_time"].values
    return responses.isel(drive_time=np.flatnonzero((time <= first_s) | (time >= last_s)))


@pytest.mark.parametrize(("first_s", "last_s"), [(2.0, 2.5), (5.5, 9.0), (-1.0, 0.5)])
def test_a_long_gap_in_the_log_is_refused(first_s, last_s):
    gap = without(recording("1/50", 50), first_s, last_s)
    with pytest.raises(InputError, match=r"at most 20 mm .* found 25\.0 mm in 1/50"):
        ANGLE.groups_of([gap])


def test_a_short_gap_or_one_before_the_steady_part_is_none():
    short, early = (without(recording("1/50", 50), *at) for at in ((2.0, 2.4), (0.1, 0.9)))
    early.attrs["steady_s"] = json.dumps([0.9, 6.0])
    assert ANGLE.groups_of([short, early]) == list("12345")
    apart = [recording(f"{t}/50", 50, zero=t, texture=t) for t in "ab"]  # drums of two marks
    assert ANGLE.groups_of(apart) == list("12345")

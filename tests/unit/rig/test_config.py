"""Nuisances: each has its switch and its strength; all off, nothing is disturbed."""

import numpy as np
import pytest

from afferents.core.errors import InputError
from afferents.rig import NUISANCES, Rig, draw
from afferents.rig.run import frame_times


def test_every_nuisance_names_a_constant_and_is_on_by_itself():
    rig = Rig()
    for section, field in NUISANCES.values():
        assert getattr(getattr(rig, section), field) > 0


@pytest.mark.parametrize("name", NUISANCES)
def test_one_nuisance_alone_leaves_all_others_off(name):
    rig = Rig().with_nuisances({name: None})
    on = [n for n, (section, field) in NUISANCES.items() if getattr(getattr(rig, section), field)]
    assert on == [name]


def test_a_strength_is_taken():
    assert Rig().with_nuisances({"tilt": 0.05}).mounting.tilt_rad == 0.05


@pytest.mark.parametrize(
    ("strengths", "sentence"),
    [
        ({"wobble": None}, r"nuisances: expected of indentation, .* found 'wobble'"),
        ({"tilt": -1.0}, r"nuisances: tilt_rad: expected .*greater than or equal to 0, found -1"),
    ],
)
def test_nuisances_that_do_not_exist_are_refused(strengths, sentence):
    with pytest.raises(InputError, match=sentence):
        Rig().with_nuisances(strengths)


def test_without_nuisances_all_runs_are_mounted_alike(quiet_rig):
    drawn = {draw(quiet_rig, texture, speed, 0) for texture in ("0", "3") for speed in (10, 50)}
    assert len(drawn) == 1
    assert drawn.pop()[:5] == (1.0, (0.0, 0.0), 0.0, 1.0, 0.0)


def test_drums_are_mounted_once_and_runs_anew_where_asked():
    once = Rig()
    mounting = once.mounting.model_copy(update={"once_a_drum": False})
    rig = once.model_copy(update={"mounting": mounting})
    assert draw(rig, "3", 50, 0) == draw(rig, "3", 50, 0)
    assert draw(rig, "3", 50, 0) != draw(rig, "3", 60, 0)
    assert draw(rig, "3", 50, 0) != draw(rig, "3", 50, 1)
    assert draw(once, "3", 50, 0) == draw(once, "3", 60, 0)
    assert draw(once, "3", 50, 0) != draw(once, "3.5", 50, 0)


def test_without_jitter_frames_are_evenly_spaced(quiet_rig, rng):
    np.testing.assert_allclose(np.diff(frame_times(quiet_rig, 2.0, rng)), 1 / 90)
    assert np.diff(frame_times(Rig(), 2.0, rng)).std() == pytest.approx(0.0003 * 2**0.5, rel=0.2)

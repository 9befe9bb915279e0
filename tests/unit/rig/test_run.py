"""A run: what the drum does, and what it does to the skin; noise-free where nothing disturbs it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.rig import STEADY_S, Rig, RigDrive, bumped_surface, draw
from afferents.rig.drive import PRESSED_S, STILL_S, turn
from afferents.rig.run import simulate_run

from .conftest import changed


def test_on_the_drum_the_rest_frames_are_at_rest():
    on_it = changed(Rig(), "mounting", contact_at_rest=True)
    run = simulate_run(on_it, "3", bumped_surface(3.0), 50.0, 1.6, 0)
    still = run.time_s < STILL_S
    assert still.sum() >= 30
    assert np.ptp(run.position_mm[still], axis=0).max() < 0.005
    assert (run.pressure_mn[still].max(axis=1) > 0).all()


def test_off_the_drum_the_rest_frames_are_at_rest(lifted_run):
    still = lifted_run.time_s < STILL_S
    assert np.ptp(lifted_run.position_mm[still], axis=0).max() < 1e-9
    assert not lifted_run.pressure_mn[still].any()


def test_an_undisturbed_run_is_free_of_noise(quiet_run, quiet_rig):
    again = simulate_run(quiet_rig, "3", bumped_surface(3.0, quiet_rig.drum), 50.0, 2.0, seed=7)
    for name, value in quiet_run._asdict().items():
        np.testing.assert_array_equal(value, getattr(again, name), err_msg=name)
    assert not quiet_run.room.any()
    assert np.abs(quiet_run.sensor[: round(0.4 * 44100)]).max() < 1e-5


def test_both_clocks_tell_the_same_but_for_their_offset():
    rig = Rig().with_nuisances({})
    drum = bumped_surface(3.0, rig.drum)
    straight = simulate_run(rig, "3", drum, 50.0, 2.0, 0)
    shifted_rig = changed(rig, "mounting", clock_sd_s=0.05)
    offset = round(draw(shifted_rig, "3", 50.0, 0).clock_offset_s * 44100)
    shifted = simulate_run(shifted_rig, "3", drum, 50.0, 2.0, 0)
    assert abs(offset) > 100
    # What the camera sees at t, the microphone hears at t + offset.
    inner = np.arange(10000, 70000)
    np.testing.assert_array_equal(shifted.sensor[inner], straight.sensor[inner - offset])


def test_skin_that_comes_apart_is_refused_and_reads_no_other_memory():
    rig = Rig()
    surface = replace(bumped_surface(3.0, rig.drum), grip=np.nan)
    with pytest.raises(InputError, match="a skin that stays in one piece"):
        simulate_run(rig, "3", surface, 50.0, 1.0, 0)


@pytest.mark.parametrize(
    ("skin", "sentence"),
    [
        ({"mass_mg": 0.01}, r"fastest swing moves less than 1.5 rad .* softer or heavier"),
        ({"coupling_mn_mm": 1000.0}, r"fastest swing"),
    ],
)
def test_unstable_constants_are_refused(skin, sentence):
    with pytest.raises(InputError, match=sentence):
        simulate_run(changed(Rig(), "skin", **skin), "3", bumped_surface(3.0), 50.0, 2.0, 0)


RATE_HZ = 2000.0


def turned(rng, drive, contact_at_rest=False, speed=50.0, seconds=6.0, run_out=(0.0, 0.0)):
    return turn(speed, seconds, drive, 40.0, 0.3, run_out, contact_at_rest, RATE_HZ, rng)


def calm():
    return RigDrive(eccentricity_mm=0, ripple=0, motor_ripple=0, drift_mm=0)


def test_without_nuisances_the_speed_is_the_nominal_one(rng):
    turning = turned(rng, calm())
    steady = turning.time_s > STEADY_S
    np.testing.assert_allclose(turning.speed_mm_s[steady], 50)
    np.testing.assert_allclose(turning.pressed_mm[turning.time_s > PRESSED_S], 0, atol=1e-9)
    one_second = turning.angle_rad[-1] - turning.angle_rad[-1 - round(RATE_HZ)]
    assert one_second == pytest.approx(50 / 40)


def test_ripple_has_its_strength_and_no_drift(rng):
    drive = calm().model_copy(update={"ripple": 0.02})
    turning = turned(rng, drive, seconds=60.0)
    steady = turning.speed_mm_s[turning.time_s > STEADY_S]
    assert steady.std() / 50 == pytest.approx(0.02, rel=0.2)
    assert steady.mean() == pytest.approx(50, rel=0.005)


def test_eccentricity_comes_once_a_turn(rng):
    turning = turned(rng, calm(), speed=100.0, seconds=8.0, run_out=(0.1, -0.2))
    pressed = turning.time_s > PRESSED_S
    turn_later = turning.angle_rad + 2 * math.pi
    again = np.interp(turn_later, turning.angle_rad, turning.pressed_mm, right=np.nan)
    known = pressed & ~np.isnan(again)
    np.testing.assert_allclose(again[known], turning.pressed_mm[known], atol=1e-3)
    assert np.ptp(turning.pressed_mm[pressed]) == pytest.approx(2 * math.hypot(0.1, 0.2), rel=0.01)

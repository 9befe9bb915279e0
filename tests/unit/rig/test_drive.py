"""The drum stands still, is pressed on, runs up, and turns on at its speed."""

import math

import numpy as np
import pytest

from afferents.rig import STEADY_S, RigDrive
from afferents.rig.drive import PRESSED_S, STILL_S, turn

RATE_HZ = 2000.0


def turned(rng, drive, contact_at_rest=False, speed=50.0, seconds=6.0, run_out=(0.0, 0.0)):
    return turn(speed, seconds, drive, 40.0, 0.3, run_out, contact_at_rest, RATE_HZ, rng)


def calm():
    return RigDrive(eccentricity_mm=0, ripple=0, motor_ripple=0, drift_mm=0)


def test_the_drum_stands_still_and_off_for_the_rest_frames(rng):
    turning = turned(rng, RigDrive())
    still = turning.time_s < STILL_S
    assert still.sum() / RATE_HZ > 30 / 90
    assert not turning.speed_mm_s[still].any()
    assert (turning.pressed_mm[still] < -2).all()


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

"""What the gel passes, what disturbs it, and what is written."""

import math

import numpy as np
import pytest

from afferents.rig import RigMicrophone, Skin
from afferents.rig.microphone import heard

RATE_HZ = 8820.0


def loudness_of(frequency_hz: float) -> float:
    time = np.arange(round(2 * RATE_HZ)) / RATE_HZ
    sound = heard(np.sin(2 * np.pi * frequency_hz * time), 0 * time, RATE_HZ, RigMicrophone())
    return (
        float(np.sqrt(2 * (sound[len(sound) // 2 :] ** 2).mean())) / RigMicrophone().gain_per_mn_s
    )


def test_it_hears_rates_below_its_corner_and_forces_above():
    """Each of its filters at its own frequency loses half the power; far above, nothing is left."""
    own = RigMicrophone()

    def expected(hz: float) -> float:
        low, high = hz / math.hypot(hz, own.low_hz), 1 / math.sqrt(1 + (hz / own.high_hz) ** 4)
        return low * high * own.corner_hz / math.hypot(hz, own.corner_hz)

    for hz in (own.low_hz, own.corner_hz, 10.0, 30.0, own.high_hz):
        assert loudness_of(hz) == pytest.approx(expected(hz), rel=0.03)
    assert loudness_of(1500) < 0.01 * loudness_of(10)


def test_near_pins_are_louder():
    microphone, rest = RigMicrophone(), Skin().rest_mm()
    weights = microphone.weights(rest)
    assert weights.sum() == pytest.approx(1)
    near = np.argmin(np.hypot(*(rest - [microphone.x_mm, microphone.y_mm]).T))
    assert np.argmax(weights) == near
    assert weights[0] < 2e-3 * weights[near]  # 25 mm away, 2.7 mm deep: (25 / 2.7)^-3

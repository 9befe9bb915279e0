"""Units that are driven bit by bit fire as they do on the whole recording."""

import numpy as np
import pytest

from afferents.spikes.afferents import afferent_classes
from afferents.spikes.artificial import artificial_spikes
from afferents.spikes.stream import MarkerUnits, VibrationUnits
from afferents.spikes.units import UNIT_MODELS

from .conftest import recording_of

FPS, RATE_HZ, SECONDS, MARKERS = 90, 8000, 2.0, 12


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(0)
    time = 0.3 + np.arange(round(SECONDS * FPS)) / FPS
    t = np.arange(round((0.3 + SECONDS) * RATE_HZ)) / RATE_HZ
    sound = 0.006 * np.sin(2 * np.pi * 70 * t) * (1 + np.sin(2 * np.pi * 3 * t))
    sound += 0.004 * rng.standard_normal(len(t))
    walk = np.abs(np.cumsum(rng.standard_normal((len(time), MARKERS)), axis=0) * 0.2)
    return recording_of(time, walk, np.abs(np.diff(walk, axis=0, prepend=0)), sound)


def trains(fed, n_units):
    """Times of every unit, of spikes that came in pieces."""
    time_s = np.concatenate([one.time_s for one in fed])
    unit = np.concatenate([one.unit for one in fed])
    return [time_s[unit == i] for i in range(n_units)]


@pytest.mark.parametrize("model", UNIT_MODELS)
@pytest.mark.parametrize("name", ["SA", "RA"])
def test_frame_by_frame_they_fire_as_on_the_whole(recording, model, name):
    afferent = afferent_classes()[name]
    response, time = recording[afferent.variable].values, recording["time"].values
    units = MarkerUnits(afferent, UNIT_MODELS[model])
    found = trains([units.feed(t, row) for t, row in zip(time, response, strict=True)], MARKERS)
    whole = artificial_spikes([recording], model, classes=[name], start_s=time[0])
    assert len(whole.times) > 200
    for unit in range(MARKERS):
        np.testing.assert_allclose(found[unit], whole.train(0, unit) + time[0], atol=1e-3)


def test_some_units_of_many_are_the_same_units(recording):
    afferent = afferent_classes()["SA"]
    all_of_them, some = (MarkerUnits(afferent, UNIT_MODELS["lif"], every=n) for n in (1, 5))
    rows = list(zip(recording["time"].values, recording["sa1"].values, strict=True))
    found = trains([some.feed(*row) for row in rows], 3)
    expected = trains([all_of_them.feed(*row) for row in rows], MARKERS)[::5]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


@pytest.mark.parametrize("chunk", [160, 777, 16_000])
def test_sound_in_pieces_of_any_size_drives_them_as_the_whole_does(recording, chunk):
    sound = recording["ra2"].values[:, 0]
    units = VibrationUnits(afferent_classes()["PC"], UNIT_MODELS["izhikevich"], RATE_HZ)
    at = range(0, len(sound), chunk)
    found = trains([units.feed(i / RATE_HZ, sound[i : i + chunk]) for i in at], 8)
    whole = artificial_spikes([recording], classes=["PC"], start_s=0.1)
    last_s = recording["time"].values[-1] - 0.15
    for unit in range(8):
        expected = whole.train(0, unit) + 0.1
        expected = expected[(expected > 0.3) & (expected < last_s)]
        within = found[unit][(found[unit] > 0.3) & (found[unit] < last_s)]
        # edges of the whole and of a piece are not filtered alike: a spike may move by a step
        assert abs(len(within) - len(expected)) <= 2
        nearest = np.abs(within[:, None] - expected).min(axis=1, initial=1.0)
        assert np.sum(nearest >= 1e-3) <= 0.03 * len(nearest)


def test_after_a_gap_they_begin_at_rest(recording):
    afferent, time = afferent_classes()["SA"], recording["time"].values
    rows = list(zip(time, recording["sa1"].values, strict=True))[:90]
    units = MarkerUnits(afferent, UNIT_MODELS["izhikevich"])
    once = trains([units.feed(*row) for row in rows], MARKERS)
    units.skip()
    again = trains([units.feed(*row) for row in rows], MARKERS)
    for one, other in zip(once, again, strict=True):
        np.testing.assert_array_equal(one, other)

"""The raster of the last second shows spikes that the whole recording has offline."""

import json
import math

import numpy as np
import pytest

from afferents.channels import Skin
from afferents.lab.live import Begin, LivePipeline, Sound
from afferents.lab.live.events import Trouble
from afferents.lab.live.prediction import Counters
from afferents.lab.live.raster import MarkerRaster, VibrationRaster
from afferents.lab.live.touch import Filled, Touch
from afferents.lab.live.web.snapshot import Snapshots
from afferents.spikes.artificial import artificial_spikes

from ...spikes.conftest import recording_of

FPS, MARKERS, RATE_HZ = 90, 127, 8000.0
LOST = 8


@pytest.fixture(scope="module")
def recording():
    """Two seconds of markers that wander, one of which is lost."""
    rng = np.random.default_rng(0)
    time = 0.1 + np.arange(2 * FPS) / FPS
    sa1 = np.abs(0.2 * np.cumsum(rng.standard_normal((len(time), MARKERS)), axis=0))
    sa1[60:, LOST] = np.nan
    return recording_of(time, sa1)


def frames(recording):
    """Frames as they are given out: lost markers hold what they last showed."""
    detected = ~np.isnan(recording["sa1"].values)
    held, before = recording.fillna(3.0), None
    for i, time_s in enumerate(recording["time"].values):
        names = ("sa1", "ra1") if i else ("sa1",)
        markers = {name: held[name].values[i : i + 1] for name in names}
        seen = np.where(detected[i][:, None], 0.0, np.nan) * np.ones((1, 2))
        now = Skin(seen, np.zeros((MARKERS, 2)))
        touch = Touch(time_s, seen, now, before, 0.01, None, False, Counters())
        before = now
        yield time_s, Filled(touch, markers)


def test_it_shows_spikes_of_the_last_second_as_they_are_offline_until_a_fault(recording):
    raster = MarkerRaster()
    assert raster.trains() == []
    for time_s, felt in frames(recording):
        raster.take(time_s, felt)
    first_s, last_s = recording["time"].values[[0, -1]]
    whole = artificial_spikes([recording], start_s=first_s)
    raster.skip()  # a gap takes nothing away
    assert [trains.name for trains in raster.trains()] == ["SA", "RA"]
    for trains in raster.trains():
        assert trains.units[:3] == [f"{trains.name}-{i}" for i in (0, 4, 8)]
        assert sum(map(len, trains.age_s)) > 100
        for name, ages in zip(trains.units, trains.age_s, strict=True):
            expected = whole.train(0, whole.units.index.get_loc(name)) + first_s
            expected = expected[expected > last_s - 1 + 1e-6]
            np.testing.assert_allclose(last_s - ages, expected, atol=1e-3)
        assert not len(trains.age_s[trains.units.index(f"{trains.name}-{LOST}")])
    raster.begin()
    assert raster.trains() == []


def test_a_tone_is_seen_in_the_units_of_its_band_and_in_no_other():
    time_s = np.arange(round(2 * RATE_HZ)) / RATE_HZ
    tone = 0.02 * np.sin(2 * np.pi * 60 * time_s).astype(np.float32)
    raster = VibrationRaster(RATE_HZ)
    for i in range(0, len(tone), 400):
        raster.take(time_s[i], tone[i : i + 400, None])
    (trains,) = raster.trains()
    fired = [len(ages) for ages in trains.age_s]
    assert fired[0] > 45
    assert fired[4] == 0  # a band from 200 Hz on
    assert 0.1 <= min(ages.min() for ages in trains.age_s if len(ages)) < 0.2, "filters look ahead"
    assert trains.to_dict()["spikes_a_unit"] == pytest.approx(np.mean(fired), abs=0.05)
    assert VibrationRaster(100.0).trains() == []


class Microphone:
    channel, rate_hz, speed = "audio", RATE_HZ, math.inf


def test_the_page_is_given_it_where_it_is_asked_for():
    pipeline = LivePipeline.without_models([Microphone()])
    loud = 0.05 * np.random.default_rng(0).standard_normal((8000, 1)).astype(np.float32)
    list(pipeline.feed(Sound(0.0, loud, 0.0)))
    assert pipeline.trains() == []
    pipeline.show_spikes()
    list(pipeline.feed(Sound(1.0, loud, 0.0)))
    (said,) = json.loads(json.dumps(Snapshots(pipeline).state()["spikes"]))
    assert (said["name"], len(said["units"]), len(said["ages_ms"])) == ("PC", 8, 8)
    assert all(0 <= age <= 1000 for ages in said["ages_ms"] for age in ages)
    assert said["spikes_a_unit"] > 10
    for event in (Trouble("audio", 2.0, "gone"), Begin("audio", 3.0)):
        list(pipeline.feed(event))
        assert not any(len(ages) for ages in pipeline.trains()[0].age_s)

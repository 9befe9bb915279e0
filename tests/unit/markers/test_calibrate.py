"""From a clip at rest to a sensor file that finds its markers again."""

import numpy as np
import pytest

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.markers import load_sensor, track
from afferents.markers.calibrate import calibrate, sensor_toml


@pytest.fixture
def grid():
    x, y = np.meshgrid(np.arange(8), np.arange(6))
    return np.stack([x.ravel(), y.ravel()], axis=1) * 28.0 + 50


@pytest.fixture
def rings():
    """A middle and three rings, 37 markers."""
    parts = [np.zeros((1, 2))]
    for k in (1, 2, 3):
        angle = np.arange(6 * k) * np.pi / (3 * k) + 0.3 * k
        parts.append(28 * k * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(parts) + np.array([160, 120])


def written(found, tmp_path):
    (tmp_path / "mine.toml").write_text(sensor_toml(found.sensor))
    return load_sensor(tmp_path / "mine.toml")


def test_a_square_sensor_is_described_whole(draw, video, grid, tmp_path):
    found = calibrate(video([draw(grid)] * 9), "mine", pitch_mm=1.4)
    sensor = written(found, tmp_path)
    assert (sensor.layout, sensor.rows, sensor.columns) == ("square", 6, 8)
    assert (sensor.name, sensor.pitch_mm, sensor.n_markers) == ("mine", 1.4, 48)
    assert sensor == found.sensor
    tracks = track(video([draw(grid + np.array([t, 0])) for t in range(4)]), sensor)
    assert tracks[dims.DETECTED].all()


def test_a_square_sensor_with_a_broken_pin_is_square_still(draw, video, grid, tmp_path):
    found = calibrate(video([draw(np.delete(grid, 20, axis=0))] * 9), "mine")
    sensor = written(found, tmp_path)
    assert (sensor.layout, sensor.rows, sensor.columns, sensor.n_markers) == ("square", 6, 8, 48)
    assert len(found.position) == 47


def test_only_the_frames_at_rest_are_looked_at(draw, video, grid):
    clip = video([draw(grid + np.array([max(0, t - 3), 0])) for t in range(9)])
    found = calibrate(clip, "mine")
    assert (found.n_still, found.n_looked) == (4, 9)
    order = np.lexsort((found.position[:, 0].round(), found.position[:, 1].round()))
    np.testing.assert_allclose(found.position[order], grid, atol=0.1)


def test_dark_markers_are_calibrated(draw, video, grid, tmp_path):
    clip = video([draw(grid, skin=220, marker=30)] * 9)
    assert written(calibrate(clip, "mine"), tmp_path).detector.blob_colour == 0


def test_a_free_layout_keeps_its_names_in_another_recording(draw, video, rings, tmp_path):
    sensor = written(calibrate(video([draw(rings)] * 9), "mine"), tmp_path)
    assert len(sensor.markers) == 37
    middle = rings.mean(axis=0)
    angle = np.radians(9)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    seen = (rings - middle) @ turn + middle + (8, -5)
    tracks = track(video([draw(seen)] * 3), sensor)
    names = np.array(sensor.markers)
    expected = (names - middle) @ turn + middle + (8, -5)
    np.testing.assert_allclose(tracks[dims.REST_POSITION].values, expected, atol=1.0)


def test_a_missing_pin_is_lost_and_the_others_keep_their_names(draw, video, rings, tmp_path):
    sensor = written(calibrate(video([draw(rings)] * 9), "mine"), tmp_path)
    tracks = track(video([draw(np.delete(rings, 25, axis=0))] * 3), sensor)
    lost = np.flatnonzero(~tracks[dims.DETECTED].values.any(axis=0))
    assert len(lost) == 1
    np.testing.assert_allclose(np.array(sensor.markers)[lost[0]], rings[25], atol=0.5)


@pytest.mark.parametrize(
    ("images", "sentence"),
    [
        (lambda draw, grid: [], r"expected a clip of the skin at rest, found no frames"),
        (lambda draw, grid: [draw([])] * 9, r"at least 6 bright or dark blobs"),
    ],
)
def test_a_clip_that_shows_no_sensor_at_rest_is_refused(images, sentence, draw, video, grid):
    with pytest.raises(InputError, match=sentence):
        calibrate(video(images(draw, grid)), "mine")


@pytest.mark.parametrize("pitch_mm", [0.0, -1.0, float("nan"), float("inf")])
def test_a_pitch_that_is_none_is_refused(draw, video, grid, pitch_mm):
    with pytest.raises(InputError, match="--pitch-mm: expected a distance above 0, mm"):
        calibrate(video([draw(grid)] * 9), "s", pitch_mm)

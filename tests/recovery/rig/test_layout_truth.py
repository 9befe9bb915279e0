"""Layouts that are not square: each pin of the rig is found, under its own number, and followed."""

import numpy as np
import pytest

from afferents import dims
from afferents.markers.sensor import load_sensor
from afferents.markers.track import track_markers
from afferents.recordings.video import open_video
from afferents.rig import TRUTH, VIDEO, bumped_surface, record
from afferents.rig.sensor_rig import rig_of


@pytest.mark.parametrize("name", ["hex127", "hex331", "radial127"])
def test_all_markers_are_recovered_within_015_px(name, tmp_path):
    """The camera is turned by 6 degrees against the sensor file."""
    sensor = load_sensor(name)
    record(rig_of(sensor), tmp_path / "3" / "50", "3", bumped_surface(3.0), 50.0, 1.7, seed=3)
    truth = np.load(tmp_path / "3" / "50" / TRUTH)["position"].astype(float)
    tracks = track_markers(open_video(tmp_path / "3" / "50" / VIDEO), sensor)
    after = slice(sensor.rest_frame, None)
    assert tracks.sizes[dims.MARKER] == sensor.n_markers
    # Of dense pins two may touch in the picture now and then.
    assert tracks[dims.DETECTED].values[after].mean() > 0.999
    error = tracks[dims.POSITION].values[after] - truth[after]
    assert np.sqrt(np.nanmean((error**2).sum(axis=-1))) < 0.15
    assert np.linalg.norm(truth[-1] - truth[0], axis=-1).max() > 1

"""A plan recorded with stand-ins for real devices: a V4L2 driver, a drum on a serial line."""

import struct

import cv2
import numpy as np
import pandas as pd
import pytest

from afferents.recordings.data_sets import read_session

from ...markers.conftest import draw_discs

pytest.importorskip("serial", reason="pyserial (extra 'lab') is not there")

PLAN = """
textures = ["4"]
speeds_mm_s = [40, 60]
seconds = 0.8
settle_s = 0.8
[camera]
kind = "v4l2"
device = "/x/fakecam/video0?paced=1&fps=15&film={film}"
fps_hz = 15  # a busy machine may look away for half a second
[drive]
kind = "serial"
port = "PORT"
template = "arduino"
"""
RECORD = """
from pathlib import Path
from afferents.progress import Progress
from simulated_drum import SimulatedDrum
from afferents.lab.recorder.record import make_recorder
asked, path = [], Path({path!r})
with SimulatedDrum() as drum, Progress(quiet=True) as progress:
    path.write_text(path.read_text().replace("PORT", drum.port))
    done = make_recorder(path, False, asked.append).record(path.with_suffix(""), progress)
    drum.drum.advance()
    print(json.dumps([asked, sorted(done.recorded), done.kept_aside, drum.drum.aim_mm_s]))
"""


@pytest.fixture
def film(tmp_path):
    """Four pictures of 19 x 19 discs, noisy, so that no two are the same."""
    rng = np.random.default_rng(0)
    places = np.stack(np.meshgrid(np.arange(-9, 10), np.arange(-9, 10)), axis=-1).reshape(-1, 2)
    image = draw_discs(320 + 22.0 * places - (0, 80), (480, 640), skin=0, marker=210)
    out = tmp_path / "discs"
    pictures = [cv2.subtract(image, rng.integers(0, 9, image.shape, np.uint8)) for _ in range(4)]
    coded = [bytes(cv2.imencode(".jpg", picture)[1]) for picture in pictures]
    out.write_bytes(b"".join(struct.pack("I", len(data)) + data for data in coded))
    return out


def test_camera_and_drum_as_real_ones(with_driver, film, tmp_path):
    plan = tmp_path / "plan.toml"
    plan.write_text(PLAN.format(film=film))
    asked, names, aside, aim_mm_s = with_driver(RECORD.format(path=str(plan)))
    assert aside == {}
    assert asked == ["change the drum to 4, then press enter"]
    assert names == ["4/40", "4/60"]
    assert aim_mm_s == 0
    for recording in read_session(tmp_path / "plan").recordings:
        frames = pd.read_csv(recording.source / "frames.csv", skiprows=1)
        assert (np.diff(frames.sequence) == 1).all()
        assert len(list(recording.video.frames())) == len(frames)
        assert abs(len(frames) - 2.1 * 15) <= 1
        drive = pd.read_csv(recording.source / "drive.csv", skiprows=1)
        steady = drive[drive.time_s > drive.time_s.iloc[-1] - 0.8]
        assert steady.speed_mm_s.mean() == pytest.approx(recording.speed_mm_s, rel=0.03)
        way_mm = np.ptp(steady.position_mm) / np.ptp(steady.time_s)
        assert way_mm == pytest.approx(recording.speed_mm_s, rel=0.05)

"""Sensors nobody has described: radial layouts, fish-eye lenses, reflections."""

import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from afferents import dims
from afferents.inspection.calibrate import calibrate
from afferents.markers.detect import detect
from afferents.markers.estimate import estimate_detector, recognise_sensor
from afferents.markers.quality import describe
from afferents.markers.track import track_markers
from afferents.store.recording import Frame

ROOT = Path(__file__).resolve().parents[3]
VIDEOS = ROOT / "../shared/datasets/tactip_videos"
ONE_FINGERTIP = ("north-east", "north", "south-west", "lego", "concrete")

pytestmark = pytest.mark.skipif(
    not VIDEOS.is_dir(), reason="the TacTip videos are not beside the project"
)


class RealVideo:
    """A `core.recording.Video` of a file's first frames; times from its own frame rate."""

    def __init__(self, name: str, n_frames: int) -> None:
        self.path, self.n_frames = VIDEOS / name, n_frames
        self.fps_hz, self.width, self.height = 30.0, 640, 480

    def frames(self) -> Iterator[Frame]:
        capture = cv2.VideoCapture(str(self.path))
        for index in range(self.n_frames):
            read, image = capture.read()
            if not read:
                return
            yield Frame(index / self.fps_hz, cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))


@pytest.mark.parametrize("name", ["Movement4.avi", "north.avi", "speed1.avi"])
def test_an_unseen_radial_layout_is_found_and_followed(name):
    video = RealVideo(name, n_frames=45)
    sensor, why = recognise_sensor(video)
    assert sensor.layout == "free"
    assert "another sensor" in why
    tracks = track_markers(video, sensor)
    assert 100 <= tracks.sizes[dims.MARKER] <= 165
    assert tracks[dims.DETECTED][10:].mean() > 0.85
    assert any("back within half a spacing of rest" in sentence for sentence in describe(tracks))


def test_a_clean_round_layout_is_found_whole():
    image = cv2.imread(str(VIDEOS / "raw_tactile_image.png"), cv2.IMREAD_GRAYSCALE)
    assert len(detect(image, estimate_detector(image))) == pytest.approx(331, abs=3)


@pytest.mark.slow
def test_one_fingertip_has_as_many_markers_as_the_docs_say(tmp_path):
    page = (ROOT / "docs/start.md").read_text(encoding="utf-8")
    said = re.search(r"fingertip gave ([\d, and]+) markers, all together (\d+),", page)
    clips = [VIDEOS / f"{name}.avi" for name in ONE_FINGERTIP]
    found = [calibrate(clip, tmp_path / f"{clip.stem}.toml").n_markers for clip in clips]
    assert sorted(found) == [int(n) for n in re.findall(r"\d+", said[1])]
    assert calibrate(clips, tmp_path / "all.toml").n_markers == int(said[2])


@pytest.mark.slow
def test_markers_return_to_rest_where_the_run_ends_where_it_began():
    video = RealVideo("Movement4.avi", n_frames=635)
    tracks = track_markers(video, recognise_sensor(video)[0])
    away = tracks[dims.POSITION].values[-5:] - tracks[dims.REST_POSITION].values
    seen = ~np.isnan(away[..., 0]).all(axis=0)
    distance = np.nanmedian(np.hypot(away[:, seen, 0], away[:, seen, 1]), axis=0)
    assert seen.mean() >= 0.95
    assert np.median(distance) < 1
    assert np.mean(distance < 3) >= 0.98  # two discs there are half reflections

"""Clips whose first frames are left over from an earlier run, as a camera's buffer gives them."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from afferents import dims
from afferents.lab.live.events import CameraFrame
from afferents.lab.live.follower import Follower
from afferents.markers.calibrate import calibrate_from_clips
from afferents.markers.quality import describe
from afferents.markers.rest import MOST_STALE, STILL, rest_sentences
from afferents.markers.sensor import Sensor
from afferents.markers.track import ordered_rest, track_markers
from afferents.recordings.video import open_clip

from .conftest import lay_grid

GRASPS = Path(__file__).resolve().parents[3] / "../shared/datasets/gelsight_grasps"
GRID = lay_grid(6, 8, 28, 50)
PRESSED = GRID + 0.03 * (GRID - GRID.mean(axis=0)) + (1.5, 0)
SENSOR = Sensor.model_validate({
    "name": "drawn", "layout": "square", "rows": 6, "columns": 8, "n_markers": 48, "rest_frame": 0,
    "detector": {"blob_colour": 255, "radius_px": 6.5},
})  # fmt: skip


@pytest.fixture
def clip(draw, video):
    """Return what makes a noisy clip of markers at positions, shape (frame, marker, 2), px."""

    def make(positions):
        noise = np.random.default_rng(1).normal(0, 2, (len(positions), 240, 320))
        images = np.array([draw(position) for position in positions]) + noise
        return video(list(np.clip(np.rint(images), 0, 255).astype(np.uint8)))

    return make


TOUCHED = np.where(GRID[:, :1] < 130, GRID + np.array([3, 0]), GRID)


def frames_of(*parts):
    return np.concatenate([np.repeat(position[None], n, axis=0) for position, n in parts])


@pytest.mark.parametrize(("n_stale", "before"), [(1, 0), (4, 1), (5, 0), (MOST_STALE, 1)])
def test_rest_is_where_the_picture_stands_still_after_it_jumped(clip, n_stale, before):
    swayed = GRID + 2 * np.sin(np.arange(20) / 3)[:, None, None]
    made = clip(
        np.concatenate([frames_of(((PRESSED, TOUCHED)[before], n_stale), (GRID, 6)), swayed])
    )
    tracks = track_markers(made, SENSOR)
    rest = n_stale + STILL
    assert (tracks.attrs["rest_frame"], tracks.attrs["rest_stale"]) == (rest, rest)
    np.testing.assert_allclose(tracks[dims.REST_POSITION], GRID, atol=0.1)
    np.testing.assert_allclose(ordered_rest(made, SENSOR), tracks[dims.REST_POSITION])
    assert not tracks[dims.DETECTED][:rest].any()
    assert tracks[dims.DETECTED][rest:].all()
    assert f"a ({rest} frames): the picture jumps" in rest_sentences({"a": tracks.attrs})[0]
    assert any("then stands still" in sentence for sentence in describe(tracks))
    found = calibrate_from_clips(made, "mine")
    np.testing.assert_allclose(found.position, GRID, atol=0.1)
    assert (found.sensor.rest_frame, found.clips[0].rest_frame) == (0, rest)


@pytest.mark.parametrize("n", [1, 3, 8])
def test_a_short_clip_begins_at_rest(clip, n):
    assert len(calibrate_from_clips(clip(frames_of((GRID, n))), "mine").position) == 48


@pytest.mark.parametrize(
    "moves",
    [
        frames_of((GRID, 40)),
        frames_of((GRID, MOST_STALE + 1), (PRESSED, 31)),  # later than any buffer
        # A press takes several frames, at once or after a while; a tap goes back.
        np.concatenate([GRID + np.minimum(np.arange(30), 4)[:, None, None]]),
        np.concatenate([frames_of((GRID, 4)), GRID + np.minimum(np.arange(30), 4)[:, None, None]]),
        frames_of((GRID, 4), (PRESSED, 1), (GRID, 30)),
    ],
    ids=["still", "late", "press", "pressed later", "tap"],
)
def test_skin_that_moves_begins_at_rest(clip, moves):
    tracks = track_markers(clip(moves), SENSOR)
    assert tracks.attrs["rest_frame"] == 0
    np.testing.assert_allclose(tracks[dims.REST_POSITION], GRID, atol=0.1)


def test_pictures_that_grow_dark_or_bright_do_not_move(draw, video):
    light = np.repeat([0.4, 0.9, 1.0], [1, 3, 30])
    images = [cv2.convertScaleAbs(draw(GRID), alpha=each) for each in light]
    assert track_markers(video(images), SENSOR).attrs["rest_frame"] == 0
    gone = [draw(GRID)] * 4 + [draw([])] * 20
    assert track_markers(video(gone), SENSOR).attrs["rest_frame"] == 0


@pytest.mark.parametrize("rest_frame", [0, 3])
def test_live_counts_from_the_same_frame(clip, rest_frame):
    swayed = GRID + 2 * np.sin(np.arange(20) / 3)[:, None, None]
    made = clip(np.concatenate([frames_of((PRESSED, 6), (GRID, 8)), swayed]))
    sensor = SENSOR.model_copy(update={"rest_frame": rest_frame})
    tracks = track_markers(made, sensor)
    rest = tracks.attrs["rest_frame"]
    assert rest == 6 + STILL
    follower = Follower(sensor, made.fps_hz)
    pictures = [CameraFrame(frame, 0.0) for frame in made.frames()]
    live = [touch for picture in pictures for _, touch in follower.feed(picture)]
    np.testing.assert_array_equal([one.time_s for one in live], tracks[dims.TIME][rest:])
    np.testing.assert_array_equal([one.seen for one in live], tracks[dims.POSITION][rest:])
    assert live[0].before is None


@pytest.mark.skipif(not GRASPS.is_dir(), reason="no grasps at ../shared/datasets/gelsight_grasps")
@pytest.mark.parametrize("name", ["ball_white_thread_2", "blue_mug_1", "blue_mug_8"])
def test_real_grasps_begin_after_those_before(name):
    """Five frames are the grasp before; the skin is untouched until frame 12 at least."""
    clip = open_clip(GRASPS / f"{name}.avi", 25.0)
    sensor = calibrate_from_clips(clip, name).sensor
    assert (sensor.layout, sensor.rows, sensor.columns) == ("square", 5, 7)
    tracks = track_markers(clip, sensor)
    assert tracks.attrs["rest_frame"] == 5 + STILL
    at_rest = tracks[dims.POSITION][8:12] - tracks[dims.REST_POSITION]
    assert float(np.hypot(*at_rest.values.T).max()) < 0.3

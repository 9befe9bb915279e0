"""Known marker positions in, the same positions out."""

import numpy as np
import pytest

from afferents import dims
from afferents.markers.detect import detect
from afferents.markers.sensor import load_sensor
from afferents.markers.track import track_markers

from ...unit.markers.conftest import MemoryVideo

REST = 1
"""Rest frame; that of `tip_b` would only make the drawings longer."""
N_FRAMES = REST + 14


@pytest.fixture
def tip_b():
    return load_sensor("tip_b").model_copy(update={"rest_frame": REST})


def slide(rest: np.ndarray, most_px: float) -> np.ndarray:
    """Return positions of a skin that is dragged in x, most at its centre, after the rest frame.

    Shape (N_FRAMES, 361, 2), px; no marker moves farther than `most_px` a frame.
    """
    distance = np.hypot(*(rest - rest.mean(axis=0)).T)
    grip = np.exp(-((distance / 150) ** 2))
    drag = most_px * np.clip(np.arange(N_FRAMES) - REST, 0, None)
    wave = 0.8 * np.sin(np.arange(N_FRAMES)[:, None] + rest[:, 0] / 40) * (drag > 0)[:, None]
    return rest + np.stack([drag[:, None] * grip, wave], axis=-1)


def test_markers_at_rest_are_found_to_a_tenth_of_a_pixel(draw, rest, tip_b):
    found = detect(draw(rest), tip_b)
    assert len(found) == 361
    error = np.hypot(*(found[:, None] - rest[None]).transpose(2, 0, 1)).min(axis=0)
    assert np.sqrt((error**2).mean()) < 0.1


@pytest.mark.parametrize("method", ["one-to-one", "published"])
def test_moving_markers_keep_their_names_to_a_tenth_of_a_pixel(video, rest, tip_b, method):
    truth = slide(rest, most_px=2.5)
    assert np.hypot(*(truth[-1] - rest).T).max() > 30
    tracks = track_markers(video(truth), tip_b, method, reference=rest)
    error = tracks[dims.POSITION].values[REST:] - truth[REST:]
    assert np.sqrt((error**2).sum(axis=-1).mean()) < 0.1
    assert np.abs(error).max() < 0.5
    assert tracks[dims.DETECTED].values[REST:].all()
    place = np.arange(361)
    np.testing.assert_array_equal(tracks[dims.ROW], place // 19)
    np.testing.assert_array_equal(tracks[dims.COLUMN], place % 19)


def test_covered_markers_are_lost_and_come_back_under_their_own_names(video, rest, tip_b):
    truth = slide(rest, most_px=2.5)
    covered = [180, 181, 199]
    shown = truth.copy()
    shown[REST + 3 : REST + 10, covered] = np.nan
    tracks = track_markers(video(shown), tip_b)
    detected = tracks[dims.DETECTED].values
    assert not detected[REST + 3 : REST + 10, covered].any()
    assert np.isnan(tracks[dims.POSITION].values[REST + 3 : REST + 10, covered]).all()
    # They moved by 17 px unseen, nearly one pitch: their last position would name a neighbour.
    assert np.hypot(*(truth[REST + 10, 180] - truth[REST + 2, 180])) > 15
    assert detected[REST + 10 :, covered].all()
    np.testing.assert_allclose(
        tracks[dims.POSITION].values[REST + 10 :], truth[REST + 10 :], atol=0.5
    )
    assert detected[REST:, np.setdiff1d(np.arange(361), covered)].all()


def test_published_lets_two_markers_share_a_blob_for_good(video, rest, tip_b):
    """A marker is covered while the skin shifts by 14 px, so its neighbour comes within 10 px.

    It takes the neighbour's blob and keeps it when its own shows again.
    """
    truth = np.repeat(rest[None], REST + 6, axis=0)
    truth[:, :, 0] += np.array([0.0] * (REST + 1) + [7.0] + [14.0] * 4)[:, None]
    shown = truth.copy()
    shown[REST + 1 : REST + 3, 185] = np.nan
    tracks = track_markers(video(shown), tip_b, "published", reference=rest)
    position = tracks[dims.POSITION].values
    np.testing.assert_array_equal(position[-1, 185], position[-1, 184])
    assert tracks[dims.DETECTED].values[-1, 185]

    ours = track_markers(video(shown), tip_b)[dims.POSITION].values
    np.testing.assert_allclose(ours[-1], truth[-1], atol=0.5)


def walk(n_frames: int, most_px: float) -> np.ndarray:
    """Return a common motion to and fro by `most_px`, turned at random, shape (n_frames, 2)."""
    turned = np.random.default_rng(0).normal(0, 0.3, n_frames).cumsum()
    angle = np.pi * np.arange(n_frames) + turned
    return most_px / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("most_px", [5, 9, 13])
def test_jerks_of_all_markers_together_cost_no_identity(video, rest, tip_b, most_px):
    """The way goes another direction every frame, so that no prediction helps."""
    truth = np.concatenate([rest[None], rest + walk(80, most_px)[:, None]])
    truth[REST] = rest
    found = track_markers(video(truth), tip_b)[dims.POSITION].values[REST:]
    assert np.hypot(*np.moveaxis(found - truth[REST:], -1, 0)).max() < 2


def test_markers_dropped_at_random_in_jerks_cost_no_identity(video, rest, tip_b):
    truth = np.concatenate([rest[None], rest + walk(100, 9)[:, None]])
    hidden = np.random.default_rng(1).random(truth.shape[:2]) < 0.05
    hidden[: REST + 1] = False
    shown = np.where(hidden[..., None], np.nan, truth)
    tracks = track_markers(video(shown), tip_b)
    position, detected = tracks[dims.POSITION].values, tracks[dims.DETECTED].values
    off = np.hypot(*np.moveaxis(position - truth, -1, 0))[REST:]
    assert np.nanmax(off) < 2
    assert detected[REST:][~hidden[REST:]].mean() > 0.99
    assert not detected[hidden].any()


def test_failing_light_costs_no_marker(draw, rest, tip_b):
    image = draw(rest).astype(float)
    dimming = [np.rint(light * image).astype(np.uint8) for light in np.linspace(1, 0.35, 60)]
    tracks = track_markers(MemoryVideo(dimming), tip_b)
    assert tracks[dims.DETECTED].values[REST:].all()
    assert np.abs(tracks[dims.POSITION].values[REST:] - rest).max() < 0.3

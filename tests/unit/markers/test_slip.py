"""Dense skins of small markers: calibrated whole, and no slip of many together is kept."""

import cv2
import numpy as np
import pytest

from afferents import dims
from afferents.markers.calibrate import calibrate_from_clips
from afferents.markers.quality import describe
from afferents.markers.sensor import DiscDetector, Sensor
from afferents.markers.track import track_markers

PITCH, SHAPE = 8.0, (240, 320)


@pytest.fixture(scope="module")
def dense():
    """569 markers of a hexagonal layout, 8 px apart."""
    a, b = np.meshgrid(np.arange(-13, 14), np.arange(-13, 14))
    place = np.stack([a + b / 2, b * np.sqrt(3) / 2], axis=-1).reshape(-1, 2)
    return PITCH * place[np.hypot(*place.T) <= 13] + np.array([160.0, 120.0])


def shown(position, marker=200.0, seed=0):
    """Draw discs of 2.3 px radius at sub-pixel positions, slightly blurred and noisy."""
    image, y, x = np.full(SHAPE, 60.0), *np.mgrid[-5:6, -5:6]
    for column, row in position:
        near = (slice(round(row) - 5, round(row) + 6), slice(round(column) - 5, round(column) + 6))
        cover = np.clip(2.8 - np.hypot(x + round(column) - column, y + round(row) - row), 0, 1)
        image[near] += cover * (marker - image[near])
    noise = np.random.default_rng(seed).normal(0, 2, SHAPE)
    return np.clip(np.rint(cv2.GaussianBlur(image, (0, 0), 0.8) + noise), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def sensor(dense):
    return Sensor(
        name="dense",
        layout="hexagonal",
        markers=tuple((float(x), float(y)) for x, y in dense),
        radius_px=None,
        gate_px=5.0,
        rest_frame=0,
        detector=DiscDetector(radius_px=2.3),
    )


def pressed(rest, most_px, width_px, n_frames, repeat):
    """Press the middle aside and let go, every position shown `repeat` times."""
    near = np.exp(-((rest - rest.mean(axis=0)) ** 2).sum(axis=1) / 2 / width_px**2)
    at = np.arange(n_frames) // repeat * repeat
    far = most_px * (1 - np.cos(2 * np.pi * at / n_frames)) / 2
    way = far[:, None] * np.array([np.cos(0.5), np.sin(0.5)])
    return np.concatenate([rest + near[:, None] * way[:, None], [rest] * 4])


def filmed(video, truth, repeat=1):
    return video([shown(each, seed=n // repeat) for n, each in enumerate(truth)])


def wrong(tracks, truth):
    """Return the share of positions on another marker's blob."""
    off = np.hypot(*np.moveaxis(tracks[dims.POSITION].values - truth, -1, 0))
    return float(np.mean(off > PITCH / 2))


@pytest.mark.parametrize(
    ("most_px", "width_px", "repeat"),
    [(12, 40, 1), (16, 60, 2), (24, 200, 2)],
    ids=["pressed", "pressed, frames repeated", "moved as one, frames repeated"],
)
def test_no_name_is_wrong_where_a_dense_skin_moves_fast(
    video, dense, sensor, most_px, width_px, repeat
):
    truth = pressed(dense, most_px, width_px, 24, repeat)
    tracks = track_markers(filmed(video, truth, repeat), sensor)
    assert wrong(tracks, truth) < 5e-3
    assert tracks[dims.DETECTED].values[-1].mean() > 0.99
    assert "569 are back within half a spacing of rest, 0 ended elsewhere" in describe(tracks)[0]


def test_a_slip_of_all_markers_to_the_next_row_is_found_and_put_right(video, dense, sensor):
    """Half of a press, and back at once: a step of more than half the spacing."""
    truth = np.concatenate([pressed(dense, 14, 60, 24, 1)[:13], [dense] * 5])
    tracks = track_markers(filmed(video, truth), sensor)
    assert tracks.attrs["audit_slips"] >= 1
    assert wrong(tracks, truth) < 5e-3
    assert tracks[dims.DETECTED].values[-1].all()
    assert any("had slipped together" in sentence for sentence in describe(tracks))


def test_a_skin_that_truly_moves_by_a_spacing_is_left_alone(video, dense, sensor):
    way = np.stack([np.linspace(0, PITCH, 9), np.zeros(9)], axis=1)
    truth = np.concatenate([dense + way[:, None], [dense + way[-1]] * 4])
    tracks = track_markers(filmed(video, truth), sensor)
    assert wrong(tracks, truth) == 0
    assert tracks[dims.DETECTED].values.all()
    assert tracks.attrs["audit_slips"] == 0


@pytest.mark.parametrize("marker", [200.0, 90.0])
def test_dense_skins_of_small_markers_are_calibrated_whole(video, dense, marker):
    clip = video([shown(dense, marker, seed) for seed in range(10)])
    found = calibrate_from_clips(clip, "mine")
    assert (found.sensor.layout, found.sensor.n_markers, found.n_again) == ("hexagonal", 569, 569)
    assert len(found.suspects) == 0

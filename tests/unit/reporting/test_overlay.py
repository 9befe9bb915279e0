"""A video with its markers drawn in."""

import av
import numpy as np
import pytest

from afferents.errors import InputError
from afferents.reporting.overlay import draw_overlay, write_overlay
from afferents.store.recording import Frame

N = 30


@pytest.fixture
def frames():
    return [Frame(0.1 + index / 90, np.full((120, 160), 60, np.uint8)) for index in range(N)]


@pytest.fixture
def tracks():
    """Two markers that slide right; the second is lost from frame 20 on."""
    place = np.array([[30.0, 40.0], [30.0, 90.0]])[None] + np.arange(N)[:, None, None] * (1.0, 0.0)
    detected = np.ones((N, 2), bool)
    detected[20:, 1] = False
    place[~detected] = np.nan
    return place, detected


def is_red(picture):
    blue, green, red = np.moveaxis(picture.astype(int), -1, 0)
    return (red > 150) & (green < 90) & (blue < 90)


def test_the_film_has_every_frame_twice_as_large(frames, tracks, tmp_path):
    path = write_overlay(tmp_path / "o.mp4", frames, *tracks, 90.0)
    with av.open(str(path)) as container:
        drawn = list(container.decode(video=0))
    assert len(drawn) == N
    assert (drawn[0].width, drawn[0].height) == (320, 240)
    assert float(drawn[-1].pts * drawn[-1].time_base) == pytest.approx(0.1 + (N - 1) / 90, abs=1e-3)


def test_a_lost_marker_is_red_where_it_was_last_seen(frames, tracks):
    place, detected = tracks
    last = place.copy()
    last[20:, 1] = place[19, 1]
    before, after = (draw_overlay(frames[i].image, last, detected, i) for i in (19, 25))
    assert not is_red(before).any()
    red = np.argwhere(is_red(after))
    x, y = 2 * place[19, 1] + 0.5
    assert np.abs(red.mean(axis=0) - (y, x)).max() < 8


def test_nothing_is_left_of_a_film_that_fails(frames, tracks, tmp_path):
    def broken():
        yield frames[0]
        raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="no space left"):
        write_overlay(tmp_path / "o.mp4", broken(), *tracks, 90.0)
    assert not list(tmp_path.iterdir())


def test_the_film_is_in_colour_where_the_camera_is(frames, tracks, tmp_path):
    green = np.zeros((120, 160, 3), np.uint8)
    green[..., 1] = 180
    coloured = [frame._replace(in_colour=lambda: green) for frame in frames]
    path = write_overlay(tmp_path / "o.mp4", coloured, *tracks, 90.0)
    with av.open(str(path)) as container:
        drawn = next(container.decode(video=0)).to_ndarray(format="bgr24")
    blue, level, red = np.median(drawn.reshape(-1, 3), axis=0)
    assert level > 150
    assert max(blue, red) < 40


@pytest.mark.parametrize("grey", [0, 128, 255])
def test_text_is_legible_on_any_background(grey):
    nothing = np.full((1, 1, 2), np.nan)
    image = np.full((60, 200), grey, np.uint8)
    picture = draw_overlay(image, nothing, np.zeros((1, 1), bool), 0)
    assert (picture == 255).all(axis=2).any()
    assert (picture == 0).all(axis=2).any()

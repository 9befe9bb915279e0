"""Light, focus, and frames that repeat or are missing."""

import cv2
import numpy as np
import pytest

from afferents.quality.image import measure_image_quality
from afferents.quality.repeats import count_dropped, find_repeated

from .conftest import lay_grid


@pytest.fixture
def places():
    return lay_grid(5, 7, 40, 40)


@pytest.mark.parametrize(
    ("skin", "marker", "saturated"), [(30, 200, 0), (220, 40, 0), (20, 255, 1)]
)
def test_grey_levels_are_those_of_markers_and_skin(draw, places, skin, marker, saturated):
    picture = measure_image_quality(draw(places, skin=skin, marker=marker), places, 40.0)
    assert picture.disc_grey == pytest.approx(marker, abs=10)
    assert picture.skin_grey == pytest.approx(skin, abs=10)
    assert picture.saturated == pytest.approx(saturated, abs=0.1)


def test_a_blurred_picture_has_wider_edges(draw, places):
    sharp = draw(places)
    blurred = cv2.GaussianBlur(sharp, (0, 0), 3.0)
    edges = [measure_image_quality(image, places, 40.0).edge_px for image in (sharp, blurred)]
    assert edges[0] < 1.5
    assert edges[1] > 3


def test_frames_that_repeat_are_found_between_moving_ones():
    rng = np.random.default_rng(0)
    change = np.r_[np.nan, 0.05 * rng.random(30), 2 + rng.random(60)]
    change[40], change[50] = 0.04, 0.05
    assert np.flatnonzero(find_repeated(change)).tolist() == [40, 50]
    at_rest = np.r_[np.nan, 0.03 + 0.01 * rng.random(60)]
    assert not find_repeated(at_rest).any()


def test_missing_frames_are_counted_by_their_times():
    time = np.arange(100) / 90
    assert count_dropped(time) == 0
    assert count_dropped(np.delete(time, [20, 50, 51])) == 3
    assert count_dropped(time[:1]) == 0

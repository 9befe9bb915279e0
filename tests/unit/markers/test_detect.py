"""Finding drawn markers, known and unknown."""

import cv2
import numpy as np
import pytest

from afferents.errors import InputError
from afferents.markers.detect import detect, find_discs, spacing_px
from afferents.markers.estimate import estimate_detector, recognise_sensor
from afferents.markers.sensor import WHOLE, DiscDetector, load_sensor
from afferents.markers.suspects import beyond_layout

from .conftest import lay_grid


def rings(centre=(160, 120), radii=(25, 50, 75, 100), gap=22):
    """Return a radial layout of 72 markers, shape (n, 2)."""
    angles = [np.linspace(0, 2 * np.pi, round(2 * np.pi * r / gap), endpoint=False) for r in radii]
    points = [
        np.stack([r * np.cos(a), r * np.sin(a)], axis=1) for r, a in zip(radii, angles, strict=True)
    ]
    return np.concatenate(points) + centre


def errors(found, true):
    """How far each that was found is from the nearest that was drawn, px; all must be found."""
    assert len(found) == len(true)
    return np.hypot(*(found[:, None] - true[None]).transpose(2, 0, 1)).min(axis=0)


def test_blobs_of_another_size_or_colour_are_no_markers(draw, free):
    assert len(detect(draw([[100, 100]], radius=14), free)) == 0
    assert len(detect(draw([[100, 100]], skin=230, marker=20), free)) == 0
    assert detect(draw(np.zeros((0, 2))), free).shape == (0, 2)


@pytest.mark.parametrize("radius", [2.5, 4.0, 7.0])
@pytest.mark.parametrize(("skin", "marker"), [(20, 230), (230, 20), (90, 150)])
def test_an_unseen_detector_is_estimated_from_the_picture(draw, radius, skin, marker):
    true = rings()
    image = draw(true, radius=radius, skin=skin, marker=marker)
    sensor = estimate_detector(image)
    assert sensor.layout == "free"
    assert sensor.detector.blob_colour == (255 if marker > skin else 0)
    found = detect(image, sensor)
    assert errors(found, true).max() < 0.2


def test_large_reflections_do_not_become_markers(draw):
    true = rings(radii=(25, 50, 75))
    image = np.maximum(draw(true, radius=4), draw([[20, 20], [300, 220]], radius=13))
    assert len(detect(image, estimate_detector(image))) == len(true)


def test_an_image_without_a_layout_is_refused_by_name(draw):
    with pytest.raises(InputError, match=r"dark\.avi: expected at least 6 .*found 2"):
        estimate_detector(draw([[50, 50], [90, 90]]), "dark.avi")


def test_a_video_of_an_unknown_sensor_is_recognised_as_such(draw, video):
    sensor, why = recognise_sensor(video([draw(rings(), radius=4)] * 11))
    assert sensor.name == "estimated"
    assert "finds 0 of its 361 markers in frame 10" in why
    assert "bright" in why


DISCS = DiscDetector(radius_px=5.0)


@pytest.fixture
def places():
    return lay_grid(8, 10, 25.3, 35.4)


@pytest.mark.parametrize(("skin", "marker"), [(20, 230), (230, 20), (90, 130)])
def test_discs_of_any_grey_are_found_where_they_were_drawn(draw, places, skin, marker):
    image = draw(places, radius=5, skin=skin, marker=marker)
    detector = DiscDetector(radius_px=5.0, blob_colour=255 if marker > skin else 0)
    found, area = find_discs(image, detector, WHOLE)
    assert errors(found, places).max() < 0.1
    np.testing.assert_allclose(area, np.pi * 25)


def test_light_that_falls_off_and_pools_on_the_skin_hide_no_disc(draw, places):
    """A pool of light is brighter than the markers in the dark; its slope pulls a little."""
    image = draw(places, radius=5, skin=40, marker=110).astype(float)
    y, x = np.indices(image.shape)
    image *= 1 - 0.6 * x / image.shape[1]
    image += 120 * np.exp(-(((x - 90) ** 2 + (y - 80) ** 2) / 2 / 30**2))
    found, _ = find_discs(np.clip(image, 0, 255).astype(np.uint8), DISCS, WHOLE)
    assert errors(found, places).max() < 1.2


def test_large_reflections_and_bright_rims_are_no_discs(draw, places):
    image = draw(places, radius=5, skin=40, marker=180)
    cv2.ellipse(image, (160, 8), (90, 16), 0, 0, 360, 255, -1)
    cv2.circle(image, (300, 150), 14, 255, -1)
    image[:, 0:4] = 255
    assert errors(find_discs(image, DISCS, WHOLE)[0], places).max() < 0.1


def test_noise_and_emptiness_hold_no_discs(draw):
    rng = np.random.default_rng(0)
    noise = np.clip(rng.normal(100, 3, (240, 320)), 0, 255).astype(np.uint8)
    for image in (draw([]), noise, np.zeros((6, 6), np.uint8)):
        assert len(find_discs(image, DISCS, WHOLE)[0]) == 0


def test_what_stands_apart_is_left_out_but_no_row_of_pins(places):
    stray = np.array([[1.0, 1.0], [319.0, 3.0]])
    np.testing.assert_array_equal(
        beyond_layout(np.concatenate([places, stray])),
        np.arange(len(places) + len(stray)) >= len(places),
    )
    row = np.stack([np.arange(10) * 20.0, np.zeros(10)], axis=1)
    assert not beyond_layout(row).any()


@pytest.mark.parametrize("layout", ["hex331", "radial127"])
def test_reflections_just_beyond_the_ring_of_pins_are_none_of_them(layout):
    """Two spots somewhat farther from the outermost pins than these are from each other."""
    pins = np.array(load_sensor(layout).markers)
    spacing = spacing_px(pins)
    middle = pins.mean(axis=0)
    farthest = pins[np.hypot(*(pins - middle).T).argmax()] - middle
    outwards = farthest / np.hypot(*farthest)
    spots = (
        middle + farthest + 1.35 * spacing * outwards,
        middle - farthest - 1.35 * spacing * outwards,
    )
    found = beyond_layout(np.concatenate([pins, spots]))
    assert found.tolist() == [False] * len(pins) + [True, True]
    assert not beyond_layout(pins).any()

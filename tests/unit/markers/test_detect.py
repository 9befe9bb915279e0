"""Finding drawn markers, known and unknown."""

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.markers.detect import detect
from afferents.markers.estimate import estimate_detector, recognise_sensor


def rings(centre=(160, 120), radii=(25, 50, 75, 100), gap=22):
    """Return a radial layout of 72 markers, shape (n, 2)."""
    angles = [np.linspace(0, 2 * np.pi, round(2 * np.pi * r / gap), endpoint=False) for r in radii]
    points = [
        np.stack([r * np.cos(a), r * np.sin(a)], axis=1) for r, a in zip(radii, angles, strict=True)
    ]
    return np.concatenate(points) + centre


def nearest(found, true):
    return np.hypot(*(found[:, None] - true[None]).transpose(2, 0, 1)).min(axis=0)


def test_discs_are_found_where_they_were_drawn(draw, free):
    true = np.array([[50.25, 60.5], [120.0, 80.75], [200.4, 150.1]])
    found = detect(draw(true), free)
    assert found.shape == (3, 2)
    assert nearest(found, true).max() < 0.1


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
    assert len(found) == len(true)
    assert nearest(found, true).max() < 0.2


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

"""Reading sensor files, good and bad."""

import re

import numpy as np
import pytest
from pydantic import ValidationError

from afferents.errors import InputError
from afferents.markers.rest import AtRest, order_markers
from afferents.markers.sensor import load_sensor, packaged_sensors

GOOD = """
name = "three"
layout = "free"
n_markers = 3
[detector]
min_threshold = 50
max_threshold = 150
min_area_px2 = 95
max_area_px2 = 180
min_circularity = 0.25
min_convexity = 0.58
min_inertia_ratio = 0.16
"""


@pytest.fixture
def write(tmp_path):
    def write_file(text: str):
        path = tmp_path / "sensor.toml"
        path.write_text(text)
        return path

    return write_file


def test_an_unknown_name_lists_those_there_are():
    assert "tip_b" in packaged_sensors()
    with pytest.raises(InputError, match=r"tip_x.*tip_b"):
        load_sensor("tip_x")


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("n_markers = 3", "n_markers = = 3", "TOML"),
        ("n_markers = 3", "n_pins = 3", "unknown key 'n_pins'"),
        ("min_threshold = 50", "min_treshold = 50", "the key 'detector.min_threshold'"),
        ("max_area_px2 = 180", "max_area_px2 = 90", "min_area_px2 must be less"),
        ('layout = "free"', 'layout = "free"\nrows = 3', "has no rows and columns"),
        ("max_threshold = 150", "max_threshold = 55", "min_repeatability steps"),
        ("n_markers = 3", "n_markers = 3\ngate_px = -1", "gate_px: greater than 0, found -1"),
        (
            'layout = "free"',
            'layout = "oval"',
            "'radial', 'free' or 'cells', found 'oval'",
        ),
        (
            "[detector]",
            "[picture]\nturn = 45\n[detector]",
            "picture.turn: 0, 90, 180 or 270, found 45",
        ),
        ("[detector]", "[picture]\nturn = 90\n[detector]", "turned needs width and height"),
        ("[detector]", "[picture]\nkeep = [9, 9]\n[detector]", "picture.keep.2"),
        (
            "[detector]",
            "width = 640\nheight = 480\n[picture]\nhide = [[900, 9, 50]]\n[detector]",
            "hide: expected a circle in the picture of 640 x 480 px, found [900, 9, 50]",
        ),
        (
            "n_markers = 3",
            "markers = [[9, 9], [19, 9], [9, 19]]\n[picture]\nkeep = [9, 9, 5]",
            "keep and hide must leave",
        ),
        ('layout = "free"', 'layout = "square"', "needs rows and columns"),
        ('layout = "free"', 'layout = "square"\nrows = 2\ncolumns = 2', "rows x columns = 4"),
    ],
)
def test_each_fault_names_the_file_and_the_key(write, old, new, complaint):
    assert old in GOOD
    path = write(GOOD.replace(old, new))
    with pytest.raises(InputError, match=re.escape(complaint)) as caught:
        load_sensor(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_size_of_images_is_for_layouts_without_rows_and_stands_only_where_it_is_given(write):
    sized = GOOD.replace("n_markers = 3", "n_markers = 3\nimage = [12, 14]")
    assert load_sensor(write(sized)).image == (12, 14)
    assert "image" not in load_sensor(write(GOOD)).model_dump()
    square = load_sensor("tip_b").model_dump() | {"image": (19, 19)}
    with pytest.raises(ValidationError, match="a square layout needs no image"):
        load_sensor("tip_b").model_validate(square)


@pytest.mark.parametrize("name", ["hex127", "hex331", "radial127"])
def test_layouts_of_the_package_keep_their_markers_names_and_places_in_an_image(name):
    sensor = load_sensor(name)
    turned = np.array(sensor.markers)[::-1] + np.array([3.0, -2.0])
    rest = order_markers(AtRest(turned), sensor, "windowed", None, "a test")
    assert rest.present.all()
    np.testing.assert_allclose(
        rest.position, np.array(sensor.markers) + np.array([3, -2]), atol=0.2
    )
    assert len(rest.grid.row) == sensor.n_markers
    assert order_markers(AtRest(turned), sensor, "published", None, "a test").grid is None

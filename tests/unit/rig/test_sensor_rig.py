"""The rig with another fingertip: pins and picture are those of its sensor file."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.markers.detect import detect
from afferents.markers.sensor import DiscDetector, Lens, load_sensor
from afferents.rig import Rig, project
from afferents.rig.camera import Renderer
from afferents.rig.sensor_rig import make_rig

ROOT = Path(__file__).parents[3]
LAYOUTS = ("hex127", "hex331", "radial127")


def straight(sensor):
    """The sensor's camera, not turned, without lens or noise."""
    rig = make_rig(sensor)
    plain = {"roll_deg": 0.0, "barrel": 0.0, "noise_grey": 0.0}
    return rig, rig.camera.model_copy(update=plain)


@pytest.mark.parametrize("name", LAYOUTS)
def test_markers_appear_where_the_sensor_file_has_them(name):
    sensor = load_sensor(name)
    rig, camera = straight(sensor)
    np.testing.assert_allclose(project(rig.skin.rest_mm(), camera), sensor.markers, atol=0.3)
    near = np.sort(np.hypot(*(rig.skin.rest_mm() - rig.skin.rest_mm()[0]).T))[1]
    assert near == pytest.approx(sensor.pitch_mm, rel=0.03)


def test_the_rigs_own_pins_before_another_camera():
    own = load_sensor("tip_b")
    assert make_rig(own) == Rig()
    other = own.model_copy(update={"width": 1280, "height": 960, "pitch_mm": 1.2})
    camera = make_rig(other).camera
    assert (camera.width, camera.height) == (1280, 960)


@pytest.mark.parametrize("name", LAYOUTS)
def test_packaged_files_are_as_their_script_writes_them(name):
    written = runpy.run_path(str(ROOT / "scripts" / "packaged_sensors.py"))["sensor_file"](name)
    packaged = ROOT / "src" / "afferents" / "markers" / "sensors" / f"{name}.toml"
    assert packaged.read_text() == written


def test_dark_discs_of_a_measured_size_are_drawn_as_such():
    disc = DiscDetector(blob_colour=0, radius_px=5.0)
    sensor = load_sensor("hex127").model_copy(update={"detector": disc})
    rig, camera = straight(sensor)
    picture = Renderer(camera, 0).draw(project(rig.skin.rest_mm(), camera))
    assert picture[239, 319] < 40 < 150 < picture[239, 319 + 16]
    assert len(detect(picture, sensor)) == 127


def test_another_square_layout_fits_into_its_picture():
    of_ten = {"rows": 10, "columns": 12, "n_markers": 120, "pitch_mm": 2.0, "name": "ten"}
    rig, camera = straight(load_sensor("tip_b").model_copy(update=of_ten))
    px = project(rig.skin.rest_mm(), camera).reshape(10, 12, 2)
    assert px.min() > 20
    assert (px[..., 0].max(), px[..., 1].max()) < (620, 460)
    assert (np.diff(px[..., 0], axis=1) > 0).all()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"pitch_mm": None}, "sensor 'hex127': expected pitch_mm.*--pitch-mm"),
        ({"markers": None}, "expected where its markers are, found none; calibrate it"),
        ({"pitch_mm": 5.0}, "expected pins that the rig can have, found .*within 14 mm"),
        (
            {"lens": Lens(focal_px=(500, 500), centre_px=(320, 240), distortion=(0, 0, 0, 0))},
            "expected no lens",
        ),
    ],
)
def test_sensors_that_the_rig_cannot_have_are_refused(changed, sentence):
    with pytest.raises(InputError, match=sentence):
        make_rig(load_sensor("hex127").model_copy(update=changed))

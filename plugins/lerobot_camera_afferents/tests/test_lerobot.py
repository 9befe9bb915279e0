"""The camera inside LeRobot: found, made, read, let go; see scripts/test_lerobot.sh."""

import itertools
import multiprocessing
import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("lerobot", reason="LeRobot is not installed here: make test-lerobot")

import cv2
import draccus
from lerobot.cameras import CameraConfig, make_cameras_from_configs
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot.utils.import_utils import register_third_party_plugins
from lerobot_camera_afferents import draw_signed, read_signed

import afferents
from afferents.channels import Skin
from afferents.errors import InputError
from afferents.lab.live import CameraFrame, ReplayedVideo
from afferents.lab.live.prediction import Counters
from afferents.lab.live.replay import Pace
from afferents.lab.live.touch import Touch
from afferents.markers.grid import Grid
from afferents.recordings.video import open_video
from afferents.rig.camera import RigCamera
from afferents.rig.record import write_film
from afferents.store.recording import Frame

register_third_party_plugins()
SIZE = {"width": 320, "height": 240}


def made(**asked):
    """Return a camera as the commands of LeRobot make it of what they are told."""
    config = draccus.decode(CameraConfig, {"type": "afferents", **asked})
    return make_cameras_from_configs({"touch": config})["touch"]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """Of the rig, which begins with the skin at rest."""
    session = tmp_path_factory.mktemp("clip") / "session"
    afferents.simulate(session, textures="g", speeds_mm_s=[50], seconds=6, workers=1, quiet=True)
    return str(session / "3/50/video.mp4")


def test_its_type_is_known_to_lerobot():
    config = CameraConfig.get_choice_class("afferents")
    assert config.__module__.startswith("lerobot_camera_afferents")
    assert config(source="rig").type == "afferents"


@pytest.mark.parametrize("shows", ["picture", "markers", "sa1", "ra1", "signed"])
def test_a_clip_gives_images_that_change(clip, shows):
    with made(source=clip, shows=shows, fps=90, **SIZE) as camera:
        images = [camera.read() for _ in range(20)]
        images += [camera.async_read(timeout_ms=2000), camera.read_latest(max_age_ms=2000)]
    assert {(image.shape, image.dtype) for image in images} == {((240, 320, 3), np.dtype("uint8"))}
    assert any((image != images[0]).any() for image in images)
    is_grey = (images[0] == images[0][..., :1]).all()
    assert is_grey == (shows == "picture")


def test_it_says_the_size_and_the_rate_that_nobody_asked_for(clip):
    with made(source=clip, sensor="tip_b") as camera:
        image = camera.read()
        assert (camera.height, camera.width, 3) == image.shape
        assert camera.fps == 90
        assert camera.height > 100


def test_sa1_is_drawn_by_a_scale_that_does_not_change(clip):
    def darkest(most_px):
        with made(source=clip, shows="sa1", most_px=most_px) as camera:
            return np.mean([camera.read().mean() for _ in range(20)])

    assert darkest(20.0) < darkest(2.0)


def felt(moved, moved_before=None):
    """Return what a frame shows whose markers, on a grid of 3 x 3, are displaced so."""
    row, column = np.indices((3, 3)).reshape(2, -1)
    rest = 20.0 * np.stack([column, row], axis=1)
    before = None if moved_before is None else Skin(rest + moved_before, rest)
    grid, now = Grid(row, column, 0.0), Skin(rest + moved, rest)
    return Touch(0.0, rest + moved, now, before, 0.01, grid, False, Counters())


def test_signed_images_say_displacements_and_their_change():
    rng = np.random.default_rng(0)
    before, moved = rng.uniform(-2.5, 2.5, (2, 9, 2))
    moved[4], before[7], moved[8] = np.nan, np.nan, (9.0, -9.0)
    image = draw_signed(felt(moved, before), 4.0)
    assert (image.shape, image.dtype) == ((3, 3, 3), np.dtype("uint8"))
    grown = np.hypot(*moved.T) - np.hypot(*before.T)
    expected = np.clip(np.nan_to_num(np.column_stack([moved, grown])), -4, 4).reshape(3, 3, 3)
    np.testing.assert_allclose(read_signed(image, 4.0), expected, atol=4 / 127 / 2 + 1e-6)
    assert image[1, 1].tolist() == [128, 128, 128]
    assert image[2, 2].tolist() == [255, 1, 255]
    assert (draw_signed(felt(moved), 4.0)[..., 2] == 128).all()


@pytest.fixture(scope="module")
def pushed(tmp_path_factory):
    """A clip of 9 x 9 markers at rest, then dragged 4 px to the right and up, where one is gone."""
    row, column = np.indices((9, 9)).reshape(2, -1)
    rest = np.stack([64 + 24 * column, 24 + 24 * row], axis=1)

    def pictures():
        for n in range(140):
            way = np.array([0.8, -0.6]) * 0.1 * min(max(n - 40, 0), 40)
            picture = np.full((240, 320), 40, np.uint8)
            for number, at in enumerate(rest + way):
                if n < 80 or number != 30:
                    place = np.rint(16 * at).astype(int).tolist()
                    cv2.circle(picture, place, 16 * 5, 220, -1, cv2.LINE_AA, shift=4)
            yield n / 60, picture

    path = tmp_path_factory.mktemp("pushed") / "pushed.mp4"
    write_film(path, pictures(), RigCamera(width=320, height=240, fps_hz=60))
    return str(path)


def test_a_camera_of_signed_images_gives_the_displacement_of_each_marker(pushed):
    images, asked = [], {"shows": "signed", "most_px": 4.0, "width": 9, "height": 9}
    with made(source=pushed, **asked) as camera, pytest.raises(RuntimeError, match="it has ended"):
        images.extend(camera.async_read(timeout_ms=2000) for _ in range(10_000))
    x, y, grown = np.moveaxis(read_signed(np.stack(images), 4.0), 3, 0).reshape(3, -1, 81)
    others = np.arange(81) != 30
    np.testing.assert_allclose(x[-1, others], 3.2, atol=0.15)
    np.testing.assert_allclose(y[-1, others], -2.4, atol=0.15)
    assert images[-1][3, 3].tolist() == [128, 128, 128]
    *_, last = afferents.stream(pushed)
    np.testing.assert_allclose(images[-1].astype(int), draw_signed(last, 4.0), atol=2)
    moves = (x > 0.3) & (x < 2.9)
    assert np.median(grown[moves]) == pytest.approx(0.1, abs=0.05)


def test_the_rig_runs_as_a_camera_and_ends_with_it():
    camera = made(source="rig:g/50", shows="ra1", fps=90, **SIZE)
    camera.connect()
    images = [camera.async_read(timeout_ms=5000) for _ in range(20)]
    assert len(multiprocessing.active_children()) == 1
    assert images[0].shape == (240, 320, 3)
    assert images[0].dtype == np.uint8
    assert any((image != images[0]).any() for image in images)
    camera.disconnect()
    assert multiprocessing.active_children() == []


def test_what_is_disconnected_is_free_to_be_connected_again(clip):
    camera = made(source=clip, shows="picture")
    with pytest.raises(DeviceNotConnectedError):
        camera.read()
    camera.connect()
    assert camera.is_connected
    with pytest.raises(DeviceAlreadyConnectedError):
        camera.connect()
    camera.disconnect()
    assert not camera.is_connected
    assert not [t for t in threading.enumerate() if t.name.startswith("afferents-")]
    with pytest.raises(DeviceNotConnectedError):
        camera.async_read()
    camera.connect()
    assert camera.read().shape == (480, 640, 3)
    camera.disconnect()


def test_the_end_of_a_clip_is_said(clip):
    with made(source=clip, shows="picture") as camera:
        with pytest.raises(RuntimeError, match=r"picture of .*video.mp4: it has ended; disconn"):
            [camera.read() for _ in range(10_000)]
        with pytest.raises(RuntimeError, match="it has ended"):
            camera.read_latest()


def test_a_camera_is_asked_for_its_rate_and_let_go(clip, monkeypatch):
    taken = []

    class Plugged(ReplayedVideo):
        def __init__(self, *asked):
            super().__init__(open_video(Path(clip)), Pace())
            taken.append((self, asked))
            self.rate_hz = asked[1]

    monkeypatch.setattr("afferents.lab.live.sensors.Camera", Plugged)
    with made(source="camera:2", sensor="tip_b", shows="sa1", fps=90, **SIZE) as camera:
        assert camera.read().shape == (240, 320, 3)
    ((source, asked),) = taken
    assert asked[:2] == ("2", 90)
    assert source._pace.closed.is_set()


def test_a_timeout_says_what_went_wrong(monkeypatch):
    class Dark:
        channel, rate_hz, speed, is_open = "video", 90.0, 1.0, True

        def __init__(self, *asked):
            pass

        def events(self):
            for i in itertools.takewhile(lambda _: self.is_open, itertools.count()):
                time.sleep(0.01)
                yield CameraFrame(Frame(i / 90, np.zeros((480, 640), np.uint8)), time.monotonic())

        def close(self):
            self.is_open = False

    monkeypatch.setattr("afferents.lab.live.sensors.Camera", Dark)
    monkeypatch.setattr("lerobot_camera_afferents.camera.PATIENCE_MS", 3000)
    camera = made(source="camera:0")
    said = "sa1 of camera:0: expected an image in 3000 ms, found none: the first pictures: "
    with pytest.raises(TimeoutError, match=said):
        camera.connect()
    assert not camera.is_connected


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"source": "rig", "shows": "heat"}, "shows: expected picture, markers, .* found 'heat'"),
        ({"source": "rig", "width": 0}, "width: expected a number above 0, found 0"),
        ({"source": "rig", "most_px": -1.0}, "most_px: expected a number above 0, found -1"),
    ],
)
def test_a_wrong_config_is_refused_in_a_sentence(asked, said):
    with pytest.raises(InputError, match=f"^{said}"):
        made(**asked)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"source": "nothing.mp4"}, "source: expected camera:0, .* found 'nothing.mp4'"),
        ({"source": "rig:g/fast"}, "rig: expected rig:TEXTURE/SPEED, .* found 'rig:g/fast'"),
        ({"source": "rig", "sensor": "none.toml"}, "none.toml: expected a sensor file"),
        ({"source": "camera:97"}, "camera .*97: expected "),
        ({"source": "CLIP", "fps": 30}, "fps: expected 90, as .*video.mp4 has, found 30"),
    ],
)
def test_what_can_not_be_connected_is_said_in_a_sentence(asked, said, clip):
    camera = made(**{**asked, "source": asked["source"].replace("CLIP", clip)})
    with pytest.raises(ConnectionError, match=f"^{said}"):
        camera.connect()
    assert not camera.is_connected


def test_cameras_are_listed_by_the_names_that_source_takes():
    found = type(made(source="rig")).find_cameras()
    assert all(one["id"].startswith("camera:") for one in found)

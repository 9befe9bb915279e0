"""A camera through FFmpeg, which has one of its own that needs no hardware."""

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.lab import devices

VIRTUAL = {"kind": "portable", "driver": "lavfi", "fps_hz": 30.0}


def test_frames_are_numbered_and_what_is_unknown_is_said():
    table = VIRTUAL | {"device": "color=gray:size=640x480:rate=30"}
    with devices.make_device(devices.CAMERAS, table, "[camera]") as camera:
        frames = []
        for frame in camera.frames():
            frames.append(frame)
            if len(frames) == 5:
                camera.end()
        assert [frame.sequence for frame in frames] == list(range(5))
        assert (np.diff([frame.time_s for frame in frames]) > 0).all()
        assert camera.settings.fps_hz == 30
        assert camera.settings.format == "GREY"
        assert any("frames were lost" in text for text in camera.settings.unknown)
        luma, levels = devices.decode_picture(frames[0].data, camera.settings)
        assert levels is None
        assert luma.shape == (480, 640)
        assert luma.mean() == pytest.approx(128, abs=2)


def test_its_end_is_said():
    table = VIRTUAL | {"device": "color=gray:size=640x480:rate=30:duration=0.1"}
    with devices.make_device(devices.CAMERAS, table, "[camera]") as camera:
        with pytest.raises(devices.DeviceError, match="no more frames"):
            list(camera.frames())
        camera.close()
        with pytest.raises(devices.DeviceError, match="not open"):
            next(camera.frames())


@pytest.mark.parametrize(
    ("device", "said"),
    [
        ("color=gray:size=320x240:rate=30", "expected 640 x 480 px, found 320 x 240 px"),
        ("nothing_of_the_kind", "a camera that is plugged in and free"),
    ],
)
def test_what_it_has_not_is_refused(device, said):
    with pytest.raises(InputError, match=said):
        devices.make_device(devices.CAMERAS, VIRTUAL | {"device": device}, "[camera]").open()


@pytest.mark.parametrize("form", ["MJPG", "GREY", "YUYV"])
def test_pictures_are_those_that_were_coded(form, rng):
    import cv2

    picture = cv2.blur(rng.integers(16, 236, (48, 64), np.uint8), (5, 5))
    coded = {
        "MJPG": cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes(),
        "GREY": picture.tobytes(),
        "YUYV": np.dstack([picture, np.full_like(picture, 128)]).tobytes(),
    }[form]
    settings = devices.CameraSettings("", form, 64, 48, 30.0)
    luma, levels = devices.decode_picture(coded, settings)
    np.testing.assert_allclose(luma.astype(int), picture.astype(int), atol=8)
    assert (levels is None) == (form != "YUYV")
    assert not devices.is_torn(coded, settings)
    assert devices.is_torn(coded[: len(coded) // 2], settings)
    assert devices.decode_picture(coded[:50], settings) is None
    assert devices.decode_picture(b"", settings) is None


def test_jpegs_without_huffman_tables_are_pictures_too(rng):
    """Many cameras leave out the tables that all of them have in common."""
    import cv2

    picture = cv2.blur(rng.integers(0, 256, (48, 64), np.uint8), (5, 5))
    coded = cv2.imencode(".jpg", picture)[1].tobytes()
    bare = coded
    while (at := bare.find(b"\xff\xc4")) >= 0:
        bare = bare[:at] + bare[at + 2 + int.from_bytes(bare[at + 2 : at + 4]) :]
    settings = devices.CameraSettings("", "MJPG", 64, 48, 30.0)
    assert len(bare) < len(coded)
    np.testing.assert_array_equal(
        devices.decode_picture(bare, settings)[0], devices.decode_picture(coded, settings)[0]
    )

"""Videos that FFmpeg just wrote, whole and broken."""

import cv2
import numpy as np
import pytest

from afferents.errors import InputError
from afferents.recordings.video import VideoFile, open_video

FASTSTART = {"movflags": "faststart"}
FORMATS = [
    pytest.param("v.mp4", {"options": {"crf": "4"}}, id="h264"),
    pytest.param("v.mp4", {"options": {"crf": "4"}, "colour": True}, id="h264-colour"),
    pytest.param("v.mp4", {"pixels": "yuvj420p", "options": {"crf": "4"}}, id="h264-full-range"),
    pytest.param("v.mp4", {"pixels": "yuv444p", "options": {"crf": "4"}}, id="h264-444"),
    pytest.param("v.avi", {"codec": "mjpeg", "pixels": "yuvj420p"}, id="mjpeg"),
    pytest.param("v.avi", {"codec": "mpeg4", "options": {"b:v": "4M"}}, id="mpeg4"),
    pytest.param("v.avi", {"codec": "rawvideo", "pixels": "gray"}, id="raw-grey"),
    pytest.param("v.avi", {"codec": "rawvideo", "pixels": "bgr24", "colour": True}, id="raw-bgr"),
    # width whose lines FFmpeg pads
    pytest.param("v.avi", {"codec": "mpeg4", "size": (70, 50)}, id="odd-width"),
]


@pytest.mark.parametrize(("name", "how"), FORMATS)
def test_grey_is_what_opencv_makes_of_it(tmp_path, write_video, name, how):
    path = write_video(tmp_path / name, **how)
    capture = cv2.VideoCapture(str(path))
    for frame in open_video(path).frames():
        expected = cv2.cvtColor(capture.read()[1], cv2.COLOR_BGR2GRAY)
        assert frame.image.dtype == np.uint8
        assert frame.image.shape == expected.shape
        assert np.abs(frame.image.astype(int) - expected).max() <= 2
    assert not capture.read()[0]


def test_ten_bits_become_eight(tmp_path, write_video):
    path = write_video(tmp_path / "v.mp4", pixels="yuv420p10le", options={"crf": "4"})
    image = next(open_video(path).frames()).image
    assert image.dtype == np.uint8
    ramp = np.linspace(0, 255, 64)
    assert np.abs(image.astype(float) - ramp).max() < 6
    assert image.min() <= 2
    assert image.max() >= 253


@pytest.mark.parametrize("name", ["v.mp4", "v.mkv"])
def test_what_is_known_before_frames_are_decoded(tmp_path, write_video, name):
    """A container of the second kind has no count of frames."""
    video = open_video(write_video(tmp_path / name, n_frames=18))
    assert (video.width, video.height) == (64, 48)
    assert video.fps_hz == pytest.approx(90)
    assert video.n_frames == pytest.approx(18, abs=int(name == "v.mkv"))
    assert video.duration_s == pytest.approx(18 / 90, abs=0.02)
    assert len(list(video.frames())) == 18


@pytest.mark.parametrize("bframes", ["0", "2"])
def test_times_are_the_containers(tmp_path, write_video, bframes):
    ticks_ms = [0, 11, 22, 55, 66, 78, 150, 161, 172, 183, 300, 311]
    path = write_video(tmp_path / "v.mp4", ticks_ms=ticks_ms, options={"bf": bframes})
    times = [frame.time_s for frame in open_video(path).frames()]
    np.testing.assert_allclose(times, np.array(ticks_ms) / 1000, atol=1e-4)


def test_streams_for_broadcast_begin_at_their_first_frame(tmp_path, write_video):
    video = open_video(write_video(tmp_path / "v.mpg", codec="mpeg2video", rate=30))
    assert video.header.start_s > 0.1
    times = [frame.time_s for frame in video.frames()]
    assert times == pytest.approx(np.arange(len(times)) / 30, abs=1e-4)


def test_frames_are_owned_and_can_be_read_twice(tmp_path, write_video):
    video = open_video(write_video(tmp_path / "v.avi", codec="mjpeg", pixels="yuvj420p"))
    kept = [frame.image for frame in video.frames()]
    again = [frame.image.copy() for frame in video.frames()]
    np.testing.assert_array_equal(kept, again)
    assert all(image.flags.owndata and image.flags.c_contiguous for image in kept)


@pytest.mark.parametrize(
    ("name", "how", "parts"),
    [
        ("v.mp4", {"container_options": FASTSTART, "options": {"bf": "2", "g": "5"}}, (0.3, 0.7)),
        ("v.mp4", {"container_options": FASTSTART, "options": {"bf": "0", "g": "1"}}, (0.985,)),
        ("v.avi", {"codec": "mjpeg", "pixels": "yuvj420p"}, (0.3, 0.7)),
        ("v.avi", {"codec": "mpeg4", "options": {"g": "5"}}, (0.3, 0.7)),
    ],
)
def test_truncated_video_says_where_it_stops(tmp_path, write_video, name, how, parts):
    path = write_video(tmp_path / name, n_frames=90, noise=True, **how)
    whole = path.read_bytes()
    for part in parts:
        path.write_bytes(whole[: int(part * len(whole))])
        read = []
        with pytest.raises(InputError) as caught:
            read.extend(VideoFile(path).frames())
        message = str(caught.value)
        assert str(path) in message
        assert f"after {len(read)} frames" in message
        assert "expected 90 frames (1.00 s)" in message
        assert 10 < len(read) < 90


def test_a_damaged_frame_is_never_passed_on(tmp_path, write_video):
    path = write_video(tmp_path / "v.avi", codec="mpeg4", n_frames=90, noise=True)
    content = path.read_bytes()
    middle = len(content) // 2
    path.write_bytes(content[:middle] + bytes(40) + content[middle + 40 :])
    with pytest.raises(InputError, match=r"a damaged frame\) at 0\.\d+ s after \d+ frames"):
        list(VideoFile(path).frames())


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda whole: b"", "expected a readable video"),
        (lambda whole: b"not a video at all" * 100, "expected a readable video"),
        (lambda whole: whole[:2000], "expected a readable video"),  # never finished
        (lambda whole: whole.replace(b"avc1", b"zzzz"), "a video that FFmpeg has a decoder for"),
    ],
)
def test_not_a_video(tmp_path, write_video, write_audio, spoil, said):
    path = tmp_path / "v.mp4"
    with pytest.raises(InputError, match="no such file"):
        open_video(path)
    path.write_bytes(spoil(write_video(path, noise=True).read_bytes()))
    with pytest.raises(InputError, match=rf"v\.mp4: .*{said}"):
        _ = open_video(path).header
    with pytest.raises(InputError, match="video stream"):
        open_video(write_audio(tmp_path / "audio.wav"))

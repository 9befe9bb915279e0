"""Files that are being recorded: nothing is changed, and what broke off can be read."""

import cv2
import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.lab.devices import CameraSettings
from afferents.lab.writers import SoundWriter, VideoWriter, repair
from afferents.recordings.audio import WavFile
from afferents.recordings.video import VideoFile

WIDTH, HEIGHT, FPS = 64, 48, 90
RNG = np.random.default_rng(0)


def settings(form):
    return CameraSettings("a camera", form, WIDTH, HEIGHT, FPS)


def raw(n_bytes, n):
    return [RNG.integers(0, 256, WIDTH * HEIGHT * n_bytes, np.uint8).tobytes() for _ in range(n)]


def jpegs(n):
    pictures = [RNG.integers(0, 256, (HEIGHT, WIDTH), np.uint8) for _ in range(n)]
    return [cv2.imencode(".jpg", picture)[1].tobytes() for picture in pictures]


def times(n):
    """As a camera takes them: not from 0, not quite regular, two of them lost."""
    time_s = 0.0042137 + np.arange(n + 2) / FPS + RNG.uniform(0, 0.001, n + 2)
    return np.delete(time_s, [7, 8])


@pytest.mark.parametrize(("form", "n_bytes"), [("GREY", 1), ("YUYV", 2)])
def test_raw_pixels_lose_nothing(tmp_path, form, n_bytes):
    frames, time_s = raw(n_bytes, 12), times(12)
    film = VideoWriter(tmp_path / "v.mp4", settings(form))
    for data, at_s in zip(frames, time_s, strict=True):
        film.write(data, at_s)
    film.close()
    found = list(VideoFile(tmp_path / "v.mp4").frames())
    assert np.abs([frame.time_s for frame in found] - time_s).max() < 1e-6
    for frame, data in zip(found, frames, strict=True):
        np.testing.assert_array_equal(frame.luma.ravel(), np.frombuffer(data, np.uint8)[::n_bytes])
    # A camera's grey levels are what they are; YUYV has black at 16, as television does.
    assert (found[0].levels is None) == (form == "GREY")


def test_jpegs_are_stored_as_they_came(tmp_path):
    frames, time_s = jpegs(200), times(200)
    film = VideoWriter(tmp_path / "v.mp4", settings("MJPG"))
    sizes = []
    for data, at_s in zip(frames, time_s, strict=True):
        film.write(data, at_s)
        sizes.append((tmp_path / "v.mp4").stat().st_size)
    film.close()
    content = (tmp_path / "v.mp4").read_bytes()
    assert all(data in content for data in frames)
    found = [frame.time_s for frame in VideoFile(tmp_path / "v.mp4").frames()]
    assert np.abs(np.array(found) - time_s).max() < 1e-6

    broken = tmp_path / "broken.mp4"
    broken.write_bytes(content[: sizes[-1]])
    assert len(list(VideoFile(broken).frames())) >= 200 - FPS - 2


def test_a_format_that_is_not_known_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"a camera of format MJPG, GREY, YUYV, found H264"):
        VideoWriter(tmp_path / "v.mp4", settings("H264"))


def test_a_wavs_header_is_right_with_each_block_and_repaired(tmp_path):
    samples = RNG.integers(-32768, 32767, (2500, 2), np.int16)
    sound = SoundWriter(tmp_path / "a.wav", 1000, 2)
    for block in np.split(samples, 50):
        sound.write(block)
    broken = tmp_path / "broken.wav"
    broken.write_bytes((tmp_path / "a.wav").read_bytes() + b"\1")  # in the middle of a sample
    sound.close()
    np.testing.assert_array_equal(soundfile.read(tmp_path / "a.wav", dtype="int16")[0], samples)
    assert WavFile(broken).n_samples == 2500
    with broken.open("r+b") as file:  # as if killed between a block and its length
        file.seek(40)
        file.write((2450 * 4).to_bytes(4, "little"))
    assert WavFile(broken).n_samples == 2450
    repair(broken)
    np.testing.assert_array_equal(soundfile.read(broken, dtype="int16")[0], samples)
    assert broken.stat().st_size == (tmp_path / "a.wav").stat().st_size

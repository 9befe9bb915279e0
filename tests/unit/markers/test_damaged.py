"""Pictures damaged on the way from the camera: left out or lost, never a displacement."""

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from afferents import dims
from afferents.errors import InputError
from afferents.markers.track import Tracker, track_markers
from afferents.recordings.video import open_video

from ..films import write_film
from .conftest import draw_discs, lay_grid

SHAPE, PITCH, N_FRAMES, FPS = (240, 320), 20.0, 24, 90
WRONG = 12
"""The frame that is damaged."""


@pytest.fixture(scope="module")
def rest():
    """Markers on an 11 x 11 grid, rolled by a few degrees."""
    place = lay_grid(11, 11, PITCH, -5 * PITCH)
    turn = np.array([[np.cos(0.08), np.sin(0.08)], [-np.sin(0.08), np.cos(0.08)]])
    return place @ turn + np.array([160.0, 120.0])


@pytest.fixture(scope="module")
def truth(rest):
    """A skin that swings to and fro, up to 0.7 px a frame, shape (N_FRAMES, n, 2)."""
    swing = 3 * np.sin(2 * np.pi * np.arange(N_FRAMES) / N_FRAMES)
    near = np.exp(-((rest - rest.mean(axis=0)) ** 2).sum(axis=1) / 2 / 60**2)
    return rest + swing[:, None, None] * near[:, None] * np.array([1.0, 0.3])


@pytest.fixture
def sensor(free):
    return free.model_copy(
        update={"gate_px": 10.0, "detector": free.detector.model_copy(update={"min_area_px2": 40})}
    )


def drawn(truth):
    return [draw_discs(each, SHAPE, 5.0) for each in truth]


def off(tracks, truth):
    """Return how far each marker that counts as detected is from its truth, px; 0 of lost ones."""
    order = np.argmin(
        np.linalg.norm(tracks[dims.REST_POSITION].values[:, None] - truth[0][None], axis=2), axis=1
    )
    frame = np.rint((tracks[dims.TIME].values - tracks[dims.TIME].values[0]) * FPS).astype(int)
    return np.nan_to_num(
        np.linalg.norm(tracks[dims.POSITION].values - truth[frame][:, order], axis=2)
    )


@pytest.mark.parametrize("shift_px", [-16, 8, 16, 24])
def test_the_shifted_part_of_a_picture_is_lost(video, sensor, truth, shift_px):
    images = drawn(truth)
    images[WRONG] = images[WRONG].copy()
    images[WRONG][64:] = np.roll(images[WRONG][64:], shift_px, axis=1)
    tracks = track_markers(video(images), sensor)
    seen = tracks[dims.DETECTED].values
    above = tracks[dims.REST_POSITION].values[:, 1] < 50
    assert seen[WRONG, above].all()
    assert not seen[WRONG, tracks[dims.REST_POSITION].values[:, 1] > 80].any()
    assert np.delete(seen, WRONG, axis=0).all()
    assert off(tracks, truth).max() < 0.6  # of those that the line cuts
    assert tracks.attrs["audit_torn"] == 1


def test_a_shifted_part_that_was_taken_for_a_jump_is_lost_too(sensor, truth, monkeypatch):
    """Names were followed wrongly at first; those by the layout's order show that it is a tear."""
    tracker = Tracker(sensor)
    for image in drawn(truth[:4]):
        rest = tracker.step(image).position
    below = rest[:, 1] > 120
    windowed, shifted = tracker._windowed, rest + np.where(below, 8.0, 0.0)[:, None] * [1, 0]
    monkeypatch.setattr(windowed._slips, "settle", lambda *_: shifted)
    windowed._expected[:], windowed._step[:] = rest, 0
    position, found = rest - [19.0, 0.0], np.ones(len(rest), bool)
    windowed._settle_names(drawn(truth[3:4])[0], position, found)
    np.testing.assert_array_equal(found, ~below)
    np.testing.assert_array_equal(position[~below], rest[~below])
    assert (tracker.audit.torn, tracker.audit.slips) == (1, 0)


@pytest.mark.parametrize("far_px", [5.0, 12.0, 25.0, 50.0])
def test_a_knock_is_no_damaged_picture(video, sensor, truth, far_px):
    knocked = truth.copy()
    knocked[WRONG:] += np.array([far_px * 0.6, far_px * 0.8])
    images = [cv2.copyMakeBorder(i, 0, 60, 0, 60, cv2.BORDER_REPLICATE) for i in drawn(truth)]
    images[WRONG:] = [draw_discs(each, (300, 380), 5.0) for each in knocked[WRONG:]]
    tracks = track_markers(video(images), sensor)
    assert tracks[dims.DETECTED].values[WRONG:].mean() > 0.75
    assert tracks.attrs["audit_torn"] == 0


def test_a_tap_is_followed(video, sensor, rest, truth):
    tapped = truth.copy()
    near = np.exp(-((rest - np.array([160.0, 200.0])) ** 2).sum(axis=1) / 2 / 70**2)
    tapped[WRONG:] += 9 * near[:, None] * np.array([1.0, 0.0])
    tracks = track_markers(video(drawn(tapped)), sensor)
    assert tracks[dims.DETECTED].values.all()
    assert off(tracks, tapped).max() < 0.8
    assert tracks.attrs["audit_torn"] == 0


def write_jpegs(path, images, damage):
    """Write an AVI of JPEGs, each as `damage(number, jpeg)` returns it."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=FPS)
        stream.height, stream.width = images[0].shape
        stream.pix_fmt = "yuvj420p"
        for number, image in enumerate(images):
            jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
            packet = av.Packet(damage(number, bytearray(jpeg)))
            packet.stream, packet.time_base = stream, Fraction(1, FPS)
            packet.pts = packet.dts = number
            container.mux(packet)
    return path


def test_a_jpeg_cut_short_is_a_missing_frame(tmp_path, sensor, truth):
    path = write_jpegs(
        tmp_path / "v.avi",
        drawn(truth),
        lambda number, jpeg: bytes(jpeg[: len(jpeg) // 2] if number == WRONG else jpeg),
    )
    tracks = track_markers(open_video(path), sensor)
    frames = np.rint(tracks[dims.TIME].values * FPS).astype(int)
    np.testing.assert_array_equal(frames, np.delete(np.arange(N_FRAMES), WRONG))
    assert off(tracks, truth).max() < 0.6
    counted = track_markers(open_video(path, 30.0), sensor)
    np.testing.assert_allclose(counted[dims.TIME].values, frames / 30)


def test_wrong_bits_hardly_move_a_marker(tmp_path, sensor, truth):
    """Of pictures with one wrong bit each, few markers count as detected where they are not."""
    rng = np.random.default_rng(0)

    def damage(number, jpeg):
        if number > 8 and number % 3 == 0:
            at = int(rng.integers(700, len(jpeg) - 2))
            jpeg[at] ^= 1 << int(rng.integers(8))
        return bytes(jpeg)

    many = np.concatenate([truth] * 6)
    path = write_jpegs(tmp_path / "v.avi", drawn(many), damage)
    away = off(track_markers(open_video(path), sensor), many)
    assert (away > 5).mean() < 0.01


def test_a_clip_cut_between_key_frames_is_refused(tmp_path, truth):
    whole = write_film(tmp_path / "v.mp4", drawn(truth), rate=FPS, options={"g": "12", "bf": "0"})
    cut = tmp_path / "cut.mp4"
    with av.open(str(whole)) as source, av.open(str(cut), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in [p for p in source.demux(video=0) if p.size][1:]:
            packet.stream = stream
            target.mux(packet)
    with pytest.raises(InputError, match=r"cut\.mp4: expected a first picture .* key frame"):
        list(open_video(cut).frames())


def test_pictures_that_change_size_are_refused(tmp_path, truth):
    images = drawn(truth)
    small = [cv2.resize(image, (160, 120)) for image in images]

    def later(number, jpeg):
        if number < WRONG:
            return bytes(jpeg)
        return cv2.imencode(".jpg", small[number])[1].tobytes()

    path = write_jpegs(tmp_path / "v.avi", images, later)
    with pytest.raises(InputError, match=r"of 320x240 px to the end, found 160x120 px at 0\.13 s"):
        list(open_video(path).frames())

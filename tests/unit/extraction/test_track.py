"""calibrate, track and the overlay, from the command line."""

import cv2
import numpy as np
import pytest
import xarray as xr

import afferents
from afferents import dims
from afferents.markers.sensor import load_sensor
from afferents.store.zarr_store import open_responses

from ...conftest import draw
from ..films import make_images, write_film

FINE = {"preset": "superfast", "crf": "15"}


@pytest.fixture(scope="module")
def clip(session):
    return session / "1" / "20" / "video.mp4"


def tracks_in(store):
    return xr.open_zarr(store, consolidated=False).load()


def test_a_sensor_is_calibrated_and_used(does, clip, tmp_path):
    sensor, store = tmp_path / "mine.toml", tmp_path / "t.zarr"
    out = does("calibrate", clip, "--out", sensor, "--pitch-mm", "1.2")
    assert "361 bright markers" in out
    assert "square, 19 x 19" in out
    assert (tmp_path / "mine.png").stat().st_size > 10_000
    assert load_sensor(sensor).rows == 19
    does("track", clip, store, "--sensor", sensor, "--quiet")
    tracks = tracks_in(store)
    assert tracks.sizes[dims.MARKER] == 361
    assert {dims.POSITION, dims.SA1, dims.RA1, dims.FRAME_CHANGE} <= set(tracks)
    assert tracks.attrs["stopped"] == ""
    xr.testing.assert_equal(afferents.track(str(clip), sensor), tracks)


def test_a_folder_of_images_is_a_clip_whose_rate_must_be_said(does, fails, clip, tmp_path):
    images = tmp_path / "rest"
    sensor = images / "mine1.toml"  # its picture is no image 1 of the clip
    images.mkdir()
    for n, image in enumerate(make_images(clip)[:15]):
        cv2.imwrite(str(images / f"{n}.png"), image)
    assert "361 bright markers" in does("calibrate", images, "--out", sensor)
    track = ("track", images, tmp_path / "t.zarr", "--sensor", sensor, "--quiet")
    assert "the rate at which the images were taken, found neither" in fails(*track)
    does(*track, "--fps", 30)
    assert tracks_in(tmp_path / "t.zarr").time[-1] == pytest.approx(14 / 30)
    assert "Video of 640 x 480 px" in does("inspect", images, "--fps", 30, "--out", tmp_path / "p")


def test_a_session_is_tracked_without_its_sound(does, session, tmp_path):
    does("track", session, tmp_path / "t.zarr", "--quiet", "--workers", 1)
    recordings = open_responses(tmp_path / "t.zarr")
    assert len(recordings) == 9
    assert all(dims.SA1 in r and dims.RA2 not in r for r in recordings)


def test_of_a_video_cut_off_the_start_is_kept_and_marked(run, clip, tmp_path):
    whole, cut = tmp_path / "a.avi", tmp_path / "cut.avi"
    write_film(whole, make_images(clip), "mjpeg", "yuvj420p", options={"qscale": "3"})
    content = whole.read_bytes()
    cut.write_bytes(content[: int(0.7 * len(content))])
    code, _, err = run("track", cut, tmp_path / "t.zarr", "--quiet")
    assert code == 3
    assert "frames before that are kept" in err
    tracks = tracks_in(tmp_path / "t.zarr")
    assert 15 < tracks.sizes[dims.TIME] < 45
    assert "expected 45 frames" in tracks.attrs["stopped"]


@pytest.mark.parametrize(
    ("level", "fault"), [(0, "black (mean grey level 0)"), (255, "overexposed")]
)
def test_a_picture_without_light_or_with_too_much_is_named(fails, level, fault, tmp_path):
    video = write_film(tmp_path / "v.mp4", [np.full((480, 640), level, np.uint8)] * 15)
    track = ("track", video, tmp_path / "t.zarr", "--sensor", "tip_b", "--quiet")
    for command in (track, ("calibrate", video, "--out", tmp_path / "s.toml")):
        assert fault in fails(*command)
    assert [path.name for path in tmp_path.iterdir()] == ["v.mp4"]


def test_a_knock_is_told_with_its_time(does, tmp_path, clip):
    rest = make_images(clip)[0]
    knocked = [rest] * 45 + [np.roll(rest, 15, axis=1)] * 45
    video = write_film(tmp_path / "k.mp4", knocked, options=FINE)
    out = does("inspect", video, "--out", tmp_path, "--quiet")
    assert "all markers moved together at 0.50 s and did not come back" in " ".join(out.split())


def test_displacement_counts_from_the_clip_that_is_chosen(
    does, fails, session, make_session, tmp_path, add_reference_video
):
    """The reference clip lies 6 px to the left of every recording's own rest frame."""
    copy = make_session(tmp_path / "session", textures=(1,), speeds=(20, 40))
    add_reference_video(copy / "1" / "20")
    for video in copy.rglob("video.mp4"):
        moved = [np.roll(image, 6, axis=1) for image in make_images(video)]
        write_film(video, moved, options=FINE)
    for rest, shift in (("own", 0), ("reference", 6)):
        command = ("extract", copy, tmp_path / rest, "--rest", rest, "--workers", 1, "--quiet")
        does(*command)
        (found,) = (r for r in open_responses(tmp_path / rest) if r.attrs["name"] == "1/20")
        assert float(found[dims.SA1].values[10].mean()) == pytest.approx(shift, abs=0.1)
    command = ("extract", session, tmp_path / "none", "--rest", "reference", "--quiet")
    assert "expected a session with a reference clip (throw_away.mp4" in fails(*command)


KINDS = {
    "colour, full range": {"codec": "mjpeg", "pixels": "yuvj444p"},
    "10 bits": {"pixels": "yuv420p10le", "options": {"crf": "12"}},
    "portrait": {"options": {"crf": "12"}},
    "frames that come when they like": {"options": {"crf": "12"}},
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_video_is_tracked(run, does, fails, kind, tmp_path):
    """24 frames of markers that begin to move after the 11th."""
    turned, uneven, colour = (kind.startswith(word) for word in ("portrait", "frames", "colour"))
    shift = np.clip(np.arange(24) - 11, 0, None) * 1.5
    images = [np.rot90(draw(px)) if turned else draw(px) for px in shift]
    if colour:
        images = [np.stack([image // 2, image, image], -1) for image in images]
    steps_ms = np.random.default_rng(0).integers(5, 40, 24) if uneven else np.full(24, 11)
    how = KINDS[kind] | {"at_ms": np.cumsum(steps_ms), "form": "rgb24" if colour else "gray"}
    path, sensor = tmp_path / ("v.mkv" if colour else "v.mp4"), tmp_path / "mine.toml"
    write_film(path, images, **how)
    does("calibrate", path, "--out", sensor)
    does("track", path, tmp_path / "t.zarr", "--sensor", sensor, "--quiet")
    tracks = tracks_in(tmp_path / "t.zarr")
    assert tracks.sizes[dims.MARKER] == 361
    assert tracks[dims.DETECTED].all()
    moved = (tracks[dims.POSITION] - tracks[dims.REST_POSITION]).median(dims.MARKER)
    sideways = -moved.sel(space="y") if turned else moved.sel(space="x")
    np.testing.assert_allclose(sideways, shift, atol=0.1)
    np.testing.assert_allclose(np.diff(tracks[dims.TIME]), steps_ms[1:] / 1000, atol=1e-6)
    out = run("inspect", path, "--out", tmp_path, "--sensor", sensor)[1]
    assert ("a variable frame rate" in out) == uneven
    if turned:
        said = fails("track", path, tmp_path / "u.zarr", "--sensor", "tip_b")
        assert "expected 640 x 480 px, as sensor 'tip_b' says, found 480 x 640 px" in said
        assert "turn" in said

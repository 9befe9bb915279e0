"""calibrate, track and the overlay, from the command line."""

import json
from fractions import Fraction

import av
import numpy as np
import pytest
import xarray as xr

from afferents import dims
from afferents.markers.sensor import load_sensor
from afferents.store.zarr_store import open_responses

from ...conftest import draw, shift_px


def shifted(video, px):
    """Write a video anew with its picture moved to the right."""
    with av.open(str(video)) as source:
        images = [frame.to_ndarray(format="gray") for frame in source.decode(video=0)]
    with av.open(str(video), "w") as container:
        stream = container.add_stream(
            "libx264", rate=90, options={"preset": "superfast", "crf": "15"}
        )
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for image in images:
            moved = np.ascontiguousarray(np.roll(image, px, axis=1))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(moved, format="gray")))
        container.mux(stream.encode(None))


@pytest.fixture(scope="module")
def clip(session):
    return session / "1" / "20" / "video.mp4"


def test_a_sensor_is_calibrated_and_used(run, clip, tmp_path):
    code, out, _ = run("calibrate", clip, "--out", tmp_path / "mine.toml", "--pitch-mm", "1.2")
    assert code == 0
    assert "361 bright markers" in out
    assert "square, 19 x 19" in out
    assert (tmp_path / "mine.png").stat().st_size > 10_000
    assert load_sensor(tmp_path / "mine.toml").rows == 19
    code, out, _ = run(
        "track", clip, tmp_path / "t.zarr", "--sensor", tmp_path / "mine.toml", "--quiet"
    )
    assert code == 0
    tracks = xr.open_zarr(tmp_path / "t.zarr", consolidated=False)
    assert tracks.sizes[dims.MARKER] == 361
    assert {dims.POSITION, dims.SA1, dims.RA1, dims.FRAME_CHANGE} <= set(tracks)
    assert tracks.attrs["stopped"] == ""


def test_a_session_is_tracked_without_its_sound(run, session, tmp_path):
    code, _, _ = run("track", session, tmp_path / "t.zarr", "--quiet", "--workers", 1)
    assert code == 0
    recordings = open_responses(tmp_path / "t.zarr")
    assert len(recordings) == 9
    assert all(dims.SA1 in r and dims.RA2 not in r for r in recordings)


def test_the_overlay_is_a_film(run, make_video, tmp_path):
    clip = make_video(tmp_path / "v.mp4", shift_px(1, 20, 20))
    code, out, _ = run(
        "inspect", clip, "--out", tmp_path, "--overlay", tmp_path / "o.mp4", "--json"
    )
    assert code == 0
    assert str(tmp_path / "o.mp4") in json.loads(out)["pictures"]
    with av.open(str(tmp_path / "o.mp4")) as container:
        assert sum(1 for _ in container.decode(video=0)) == 20


def test_of_a_video_cut_off_the_start_is_kept_and_marked(run, clip, tmp_path):
    with av.open(str(clip)) as source, av.open(str(tmp_path / "a.avi"), "w") as target:
        stream = target.add_stream("mjpeg", rate=90, options={"qscale": "3"})
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuvj420p"
        for frame in source.decode(video=0):
            grey = frame.to_ndarray(format="gray")
            target.mux(stream.encode(av.VideoFrame.from_ndarray(grey, format="gray")))
        target.mux(stream.encode(None))
    content = (tmp_path / "a.avi").read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: int(0.7 * len(content))])
    code, _, err = run("track", tmp_path / "cut.avi", tmp_path / "t.zarr", "--quiet")
    assert code == 3
    assert "frames before that are kept" in err
    tracks = xr.open_zarr(tmp_path / "t.zarr", consolidated=False)
    assert 15 < tracks.sizes[dims.TIME] < 45
    assert "expected 45 frames" in tracks.attrs["stopped"]


@pytest.mark.parametrize(
    ("level", "fault"), [(0, "black (mean grey level 0)"), (255, "overexposed")]
)
def test_a_picture_without_light_or_with_too_much_is_named(run, level, fault, tmp_path):
    with av.open(str(tmp_path / "v.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=90)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for _ in range(15):
            image = np.full((480, 640), level, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
        container.mux(stream.encode(None))
    for command in (
        ("track", tmp_path / "v.mp4", tmp_path / "t.zarr", "--sensor", "tip_b", "--quiet"),
        ("calibrate", tmp_path / "v.mp4", "--out", tmp_path / "s.toml"),
    ):
        code, _, err = run(*command)
        assert code == 2
        assert fault in err
        assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["v.mp4"]


def test_a_knock_is_told_with_its_time(run, tmp_path, clip):
    with av.open(str(clip)) as source:
        rest = next(iter(source.decode(video=0))).to_ndarray(format="gray")
    with av.open(str(tmp_path / "k.mp4"), "w") as container:
        stream = container.add_stream(
            "libx264", rate=90, options={"preset": "superfast", "crf": "15"}
        )
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for index in range(90):
            image = rest if index < 45 else np.roll(rest, 15, axis=1)
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="gray")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    code, out, _ = run("inspect", tmp_path / "k.mp4", "--out", tmp_path, "--quiet")
    assert code == 0
    assert "All markers jumped together 1 times, first at 0.50 s" in out.replace("\n", " ")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("calibrate", "none.mp4", "--out", "s.toml"), "none.mp4: expected a video file"),
        (("calibrate", "none.mp4", "--out", "s.json"), "a name that ends in .toml"),
        (("calibrate", "a.mp4", "a.mp4", "--out", "s.toml"), "a.mp4: expected each clip once"),
        (("inspect", ".", "--overlay", "o.mp4"), "--overlay: expected a video"),
    ],
)
def test_what_can_not_be_followed_is_refused(arguments, sentence, run):
    code, _, err = run(*arguments)
    assert code == 2
    assert sentence in err


def test_displacement_counts_from_the_clip_that_is_chosen(
    run, session, make_session, tmp_path, add_reference_video
):
    """The reference clip lies 6 px to the left of every recording's own rest frame."""
    copy = make_session(tmp_path / "session", textures=(1,), speeds=(20, 40))
    first = copy / "1" / "20"
    add_reference_video(first)
    for video in copy.rglob("video.mp4"):
        shifted(video, 6)
    for rest in ("own", "reference"):
        code, _, err = run(
            "extract", copy, tmp_path / rest, "--rest", rest, "--workers", 1, "--quiet"
        )
        assert code == 0, err
    own, reference = (
        next(r for r in open_responses(tmp_path / rest) if r.attrs["name"] == "1/20")
        for rest in ("own", "reference")
    )
    assert float(own[dims.SA1].values[10].mean()) == pytest.approx(0, abs=0.05)
    assert float(reference[dims.SA1].values[10].mean()) == pytest.approx(6, abs=0.1)
    code, _, err = run("extract", session, tmp_path / "none", "--rest", "reference", "--quiet")
    assert code == 2
    assert "expected a session with throw_away.mp4" in err


KINDS = {
    "colour, full range": {"codec": "mjpeg", "pixels": "yuvj444p", "colour": True},
    "10 bits": {"pixels": "yuv420p10le", "options": {"crf": "12"}},
    "portrait": {"options": {"crf": "12"}, "turned": True},
    "grey, no compression": {"codec": "rawvideo", "pixels": "gray"},
    "frames that come when they like": {"options": {"crf": "12"}, "uneven": True},
}


def write_kind(path, codec="libx264", pixels="yuv420p", options=None, **kind):
    """Write 24 frames of markers that begin to move after the 11th; return their motion in x."""
    shift = np.clip(np.arange(24) - 11, 0, None) * 1.5
    rng = np.random.default_rng(0)
    at_ms = np.cumsum(rng.integers(5, 40, 24)) if kind.get("uneven") else np.arange(24) * 11
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=90, options=options or {})
        stream.width, stream.height = (480, 640) if kind.get("turned") else (640, 480)
        stream.pix_fmt = pixels
        stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
        for px, ms in zip(shift, at_ms, strict=True):
            image = np.rot90(draw(px)) if kind.get("turned") else draw(px)
            image = np.ascontiguousarray(image)
            blueish = np.stack([image // 2, image, image], -1) if kind.get("colour") else image
            layout = "rgb24" if kind.get("colour") else "gray"
            frame = av.VideoFrame.from_ndarray(blueish, format=layout)
            frame.pts, frame.time_base = int(ms), Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return shift, at_ms / 1000


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_video_is_tracked(run, kind, tmp_path):
    path = tmp_path / ("v.mkv" if KINDS[kind].get("codec") else "v.mp4")
    shift, time_s = write_kind(path, **KINDS[kind])
    run("calibrate", path, "--out", tmp_path / "mine.toml")
    store = tmp_path / "t.zarr"
    code, _, err = run("track", path, store, "--sensor", tmp_path / "mine.toml", "--quiet")
    assert code == 0, err
    tracks = xr.open_zarr(store, consolidated=False)
    assert tracks.sizes[dims.MARKER] == 361
    assert tracks[dims.DETECTED].all()
    moved = (tracks[dims.POSITION] - tracks[dims.REST_POSITION]).median(dims.MARKER)
    sideways = -moved.sel(space="y") if KINDS[kind].get("turned") else moved.sel(space="x")
    np.testing.assert_allclose(sideways, shift, atol=0.1)
    if kind in ("portrait", "frames that come when they like"):
        code, out, _ = run("inspect", path, "--out", tmp_path, "--sensor", tmp_path / "mine.toml")
        assert ("a variable frame rate" in out) == bool(KINDS[kind].get("uneven"))
    if KINDS[kind].get("uneven"):
        np.testing.assert_allclose(np.diff(tracks[dims.TIME]), np.diff(time_s), atol=1e-6)


def test_a_turned_video_is_refused_for_a_sensor_of_another_size(run, tmp_path):
    write_kind(tmp_path / "v.mp4", turned=True)
    code, _, err = run("track", tmp_path / "v.mp4", tmp_path / "t.zarr", "--sensor", "tip_b")
    assert code == 2
    assert "expected 640 x 480 px, as sensor 'tip_b' says, found 480 x 640 px" in err
    assert "turn" in err

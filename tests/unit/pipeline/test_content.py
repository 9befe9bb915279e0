"""Recordings that decode well and are wrong: named, refused, kept only where the user says so."""

import json
import shutil

import av
import numpy as np
import pytest
import soundfile
import xarray as xr

from afferents.extraction.extract import extract_session
from afferents.extraction.options import Extraction
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import simulation_of

VIDEO, AUDIO = "8/50/video.mp4", "8/50/audio.wav"


@pytest.fixture(scope="module")
def slides(tmp_path_factory):
    """Two simulated recordings of 3.5 s, without the checksums that would tell every change."""
    root = tmp_path_factory.mktemp("slides") / "session"
    quick = simulation_of(root, "quick", ["8"], [40.0, 50.0], 3.5)
    simulate_session(quick, 1, Progress(quiet=True))
    declared = json.loads((root / "session.json").read_text())
    (root / "session.json").write_text(json.dumps({"steady_s": declared["steady_s"]}))
    return root


@pytest.fixture(scope="module")
def whole(slides, tmp_path_factory):
    """What is extracted of them."""
    store = tmp_path_factory.mktemp("whole") / "s.zarr"
    extraction = Extraction(slides, store, load_sensor("tip_b"), "windowed", workers=1)
    with Progress(quiet=True) as progress:
        extract_session(extraction, progress)
    return store


@pytest.fixture
def spoilt(slides, whole, tmp_path):
    """A copy of them, one of which is to be spoilt; the store has the other already."""
    shutil.copytree(whole, tmp_path / "o.zarr")
    shutil.rmtree(tmp_path / "o.zarr" / "8" / "50")
    return shutil.copytree(slides, tmp_path / "session")


def images_of(path):
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]


def encode(path, images, crf="23"):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=90, options={"crf": crf})
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, "gray")))
        container.mux(stream.encode(None))


CHANGES = {
    "frozen": lambda i: i[:150] + [i[150]] * (len(i) - 150),
    "repeated": lambda i: [frame for frame in i[::4] for _ in range(4)][: len(i)],
    "dark": lambda i: i[:200] + [np.zeros_like(i[0])] * (len(i) - 200),
    "length": lambda i: i[: len(i) // 2],
}


@pytest.mark.parametrize("kind", CHANGES)
def test_a_wrong_picture_is_refused_or_kept_and_marked(fails, run, spoilt, tmp_path, kind):
    encode(spoilt / VIDEO, CHANGES[kind](images_of(spoilt / VIDEO)))
    command = ("extract", spoilt, tmp_path / "o.zarr", "--workers", "1", "--quiet")
    sentence = fails(*command)
    assert f"keep it as it is with --accept {kind}" in sentence
    assert "8/50" in sentence
    assert fails(*command, "--accept", "loud") == sentence  # another kind
    assert "8/50" in fails(*command, "--keep-going", code=3)
    if kind == "length":  # half a picture has no steady part worth tracking further
        return
    code, _, err = run(*command, "--accept", kind)
    assert code == 0, err
    assert "8/50: kept as it is, though wrong" in err
    kept = xr.open_zarr(tmp_path / "o.zarr", group="8/50", consolidated=False)
    assert json.loads(kept.attrs["conditions"])["accepted"] == kind


def spoil_sound(session, change, subtype="FLOAT"):
    values, rate = soundfile.read(session / AUDIO, dtype="float32", always_2d=True)
    soundfile.write(session / AUDIO, change(values), rate, subtype=subtype)


def with_value(value):
    def change(values):
        values[88_200, 1] = value
        return values

    return change


@pytest.mark.parametrize(("value", "found"), [(np.nan, "nan"), (np.inf, "inf")])
def test_sound_that_is_no_number_is_named_with_its_place(fails, spoilt, tmp_path, value, found):
    spoil_sound(spoilt, with_value(value))
    command = ("extract", spoilt, tmp_path / "o.zarr", "--workers", "1", "--quiet")
    for accept in ((), ("--accept", "loud")):
        assert f"found {found} at sample 88200 (2.000 s)" in fails(*command, *accept)


def test_sound_beyond_full_scale_can_be_accepted(fails, run, spoilt, tmp_path):
    spoil_sound(spoilt, with_value(3.0))
    command = ("extract", spoilt, tmp_path / "o.zarr", "--workers", "1", "--quiet")
    assert "--accept loud" in fails(*command)
    assert run(*command, "--accept", "loud")[0] == 0


@pytest.mark.parametrize("subtype", ["FLOAT", "PCM_24", "PCM_16"])
def test_sound_that_was_cut_off(fails, spoilt, tmp_path, subtype):
    spoil_sound(spoilt, lambda values: values, subtype)
    whole = (spoilt / AUDIO).read_bytes()
    (spoilt / AUDIO).write_bytes(whole[: int(0.95 * len(whole))])
    command = ("extract", spoilt, tmp_path / "o.zarr", "--workers", "1", "--quiet")
    assert "samples as it declares" in fails(*command)


def test_a_copy_that_was_encoded_again_is_warned_of(run, spoilt, tmp_path):
    command = ("extract", spoilt, tmp_path / "o.zarr", "--workers", "1", "--quiet")
    code, _, err = run(*command)
    assert (code, err) == (0, ""), "two recordings are no copies"
    encode(spoilt / "8/40/video.mp4", images_of(spoilt / VIDEO), crf="30")
    values, rate = soundfile.read(spoilt / AUDIO, dtype="float32", always_2d=True)
    soundfile.write(spoilt / "8/40/audio.wav", 0.7 * values, rate, subtype="PCM_U8")
    shutil.rmtree(tmp_path / "o.zarr" / "8" / "40")
    code, _, err = run(*command)
    assert code == 0
    assert "8/40 and 8/50" in err
    assert "seem to be copies" in err

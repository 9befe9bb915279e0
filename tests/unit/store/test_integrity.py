"""Wrong data that decode well: copies, swaps, one name twice, stores that changed."""

import json
import shutil

import numpy as np
import pytest
import zarr

from afferents.errors import InputError
from afferents.evaluation.data import open_data
from afferents.files import checksum
from afferents.store import integrity

NO_GRID = {"name": "regular", "configuration": {"chunk_shape": [0, 1]}}
ALONE = ("--quiet", "--workers", 1)


def edited(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


@pytest.fixture
def session(sounds, tmp_path):
    """A copy of the session of sounds to spoil."""
    return shutil.copytree(sounds, tmp_path / "session")


@pytest.fixture
def store(stores, tmp_path):
    """A copy of what is extracted of it."""
    return shutil.copytree(stores["audio"], tmp_path / "s.zarr")


def test_a_recording_copied_under_another_speed(fails, session, tmp_path):
    shutil.copy(session / "2/20/audio.wav", session / "2/30/audio.wav")
    sentence = fails("extract", session, tmp_path / "o.zarr", *ALONE)
    assert "the same bytes as" in sentence
    assert {"2/20/audio.wav" in sentence, "2/30/audio.wav" in sentence} == {True}
    assert not (tmp_path / "o.zarr").exists()


@pytest.mark.parametrize(("one", "other"), [("2", "2.0"), ("2/20", "2/20.0"), ("2/20", "2/20.001")])
def test_one_texture_or_speed_under_two_names(fails, session, tmp_path, one, other):
    shutil.move(session / one, session / other)
    name = "texture" if "/" not in one else "speed"
    if name == "texture":  # beside a folder of the other name
        shutil.copytree(session / other, session / one)
    sentence = fails("extract", session, tmp_path / "o.zarr", "--quiet")
    assert f"each {name} under one name, found" in sentence
    assert not (tmp_path / "o.zarr").exists()


def test_drums_swapped_in_a_session_that_declares_checksums(fails, does, session, tmp_path):
    sums = {
        f"{path.parts[-3]}/{path.parts[-2]}": {path.name: checksum(path)}
        for path in session.glob("*/*/audio.wav")
    }
    edited(session / "session.json", lambda c: c.update(checksums=sums))
    does("extract", session, tmp_path / "good.zarr", *ALONE)
    a, b = session / "1/20", session / "2/20"
    a.rename(session / "tmp"), b.rename(a), (session / "tmp").rename(b)
    sentence = fails("extract", session, tmp_path / "o.zarr", *ALONE)
    assert "expected the file whose checksum session.json declares, found another" in sentence


def test_a_session_file_that_is_mended_needs_no_other_store(fails, does, session, stores, tmp_path):
    good = (session / "session.json").read_text()
    store = tmp_path / "o.zarr"
    edited(session / "session.json", lambda c: c.update(sample_rate_hz=16000))
    assert "at 16000 Hz" in fails("extract", session, store, *ALONE)
    (session / "session.json").write_text(good)
    does("extract", session, store, *ALONE)
    chunk = store / "2/20/ra2/c/0/0"
    assert chunk.read_bytes() == (stores["audio"] / "2/20/ra2/c/0/0").read_bytes()
    # What the declaration decides is worked out anew, and nothing else is.
    before = chunk.stat().st_mtime_ns
    does("extract", session, store, *ALONE)
    assert chunk.stat().st_mtime_ns == before
    edited(session / "session.json", lambda c: c.update(steady_s=[0.5, 2.5]))
    does("extract", session, store, *ALONE)
    attributes = json.loads((store / "2/20/zarr.json").read_text())["attributes"]
    assert attributes["steady_s"] == "[0.5, 2.5]"
    before = open_data([str(store)])[0]
    edited(session / "session.json", lambda c: c.update(sensor_channel=0))
    does("extract", session, store, *ALONE)
    after = open_data([str(store)])[0]
    assert after.origin.fingerprint != before.origin.fingerprint
    assert not any(r["ra2"].any() for r in after.responses)  # the other channel is silent


def test_no_old_responses_stay_beside_recordings_that_fail(fails, run, does, session, tmp_path):
    command = ("extract", session, tmp_path / "o.zarr", *ALONE)
    does(*command)
    edited(session / "session.json", lambda c: c.update(steady_s=[0.5, 2.5], audio_channels=3))
    assert run(*command, "--keep-going")[0] == 3
    assert not list((tmp_path / "o.zarr").glob("*/*/ra2"))
    edited(session / "session.json", lambda c: c.update(audio_channels=2))
    does(*command)
    (session / "2/20/audio.wav").write_bytes(b"cut off")
    sentence = fails(*command, "--keep-going")
    assert "2/20: expected responses of the recording as it is now, found responses" in sentence


def test_a_broken_recording_is_made_again(does, sounds, store):
    whole = (store / "2/20/ra2/c/0/0").read_bytes()
    shutil.rmtree(store / "2/20/ra2")
    (store / "2/30/zarr.json").unlink()
    (store / "1/20/ra2/zarr.json").write_text("{")
    does("extract", sounds, store, *ALONE)
    assert (store / "2/20/ra2/c/0/0").read_bytes() == whole
    assert len(open_data([str(store)])[0].responses) == 12


def attribute(**changed):
    return lambda store: edited(
        store / "2/20/zarr.json", lambda c: c["attributes"].update(**changed)
    )


def of_array(**changed):
    return lambda store: edited(store / "2/20/ra2/zarr.json", lambda c: c.update(**changed))


def values(change):
    def rewrite(store):
        path = store / "2/20/ra2"
        array = zarr.open_array(path, mode="r+", config={"write_empty_chunks": True})
        array[...] = change(array[...])

    return rewrite


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (attribute(speed_mm_s=60.0), "their digest says so"),
        (attribute(texture="3"), "their digest says so"),
        (attribute(name="2/30"), "their digest says so"),
        (attribute(speed_mm_s="fast"), "with speed_mm_s: "),
        (attribute(speed_mm_s=-5.0), "with speed_mm_s: "),
        (attribute(speed_mm_s=float("nan")), "no finite number"),
        (attribute(texture=""), "with texture: "),
        (attribute(steady_s="[3, 1]"), "with steady_s: "),
        (attribute(steady_s="[NaN, NaN]"), "with steady_s: "),
        (attribute(conditions="[1]"), "with conditions: "),
        (of_array(attributes={"sample_rate_hz": 0}), "a sample_rate_hz from 1 to"),
        (of_array(attributes={}), "the attribute 'sample_rate_hz'"),
        (of_array(attributes={"sample_rate_hz": 4000.0}), "their digest says so"),
        (of_array(data_type="int32"), "responses that can be read"),
        (of_array(shape=[-1, 1]), "responses that can be read"),
        (of_array(zarr_format=9), "responses that can be read"),
        (of_array(chunk_grid=NO_GRID), "responses that can be read"),
        (of_array(codecs=[{"name": "evil"}]), "responses that can be read"),
        (
            lambda s: shutil.copytree(s / "2/20", s / "2/30", dirs_exist_ok=True),
            "of '2/30', found those of '2/20'",
        ),
        (
            lambda s: shutil.copytree(s / "2/20", s / "2/25"),
            "2/25: expected a recording that the store names",
        ),
    ],
)
def test_a_store_whose_metadata_changed_is_refused(store, change, sentence):
    change(store)
    with pytest.raises(InputError, match=r"2/2.*: expected .*found .*|of '2/20'") as refused:
        open_data([str(store)])
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (values(lambda v: v + 1), "their digest says so"),
        (values(lambda v: v * np.nan), "1 chunks, found 0"),
        (values(lambda v: v + np.inf), "their digest says so"),
        (lambda s: shutil.copy(s / "2/30/ra2/c/0/0", s / "2/20/ra2/c/0/0"), "their digest says so"),
    ],
)
def test_a_store_whose_values_changed_is_refused_when_they_are_read(
    fails, store, tmp_path, change, sentence
):
    change(store)
    said = fails("evaluate", store, "--out", tmp_path / "r", "--models", "vib-te", *ALONE)
    assert "2/20" in said
    assert sentence in said


def test_damage_to_the_store_is_found_before_anything_is_trained(
    stores, tmp_path, fails, monkeypatch
):
    monkeypatch.setattr(integrity, "_SMALL", 0)  # long recordings are not read when they are opened
    store, results = shutil.copytree(stores["video"], tmp_path / "s.zarr"), tmp_path / "r"
    (chunk,) = [p for p in (store / "2/40/sa1/c").rglob("*") if p.is_file()][:1]
    chunk.write_bytes(chunk.read_bytes()[:-7])
    command = ("evaluate", store, "--out", results, "--models", "sa-wave", *ALONE)
    sentence = fails(*command, "--keep-going", code=3)
    assert "2/40 (sa1 of 2/40: expected data that can be read" in sentence
    summary = json.loads((results / "summary.json").read_text())
    assert [one["recording"] for one in summary["skipped"]] == ["2/40"]


def test_the_same_recordings_are_no_repetition(does, store, session, tmp_path):
    copy = shutil.copytree(store, tmp_path / "copy.zarr")
    with pytest.raises(InputError, match="the same recordings twice"):
        open_data([str(store), str(copy)])
    # Another extraction of the same files: other fingerprint, same recordings.
    edited(session / "session.json", lambda c: c.update(steady_s=[0.4, 2.5]))
    does("extract", session, tmp_path / "other.zarr", *ALONE)
    with pytest.raises(InputError, match="expected a recording of its own, found a copy of 1:"):
        open_data([str(store), str(tmp_path / "other.zarr")])

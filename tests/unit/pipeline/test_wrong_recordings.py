"""Wrong data that decode well: copies, swaps, one name twice, stores that changed."""

import json
import shutil

import numpy as np
import pytest
import zarr

from afferents.errors import InputError
from afferents.evaluation.data import open_data

ALONE = ("--workers", 1)


def edited(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


@pytest.fixture
def session(sounds, tmp_path):
    """A copy of the small session to spoil."""
    return shutil.copytree(sounds, tmp_path / "session")


@pytest.fixture
def store(stores, tmp_path):
    return shutil.copytree(stores["audio"], tmp_path / "s.zarr")


def test_a_recording_copied_under_another_speed(fails, session, tmp_path):
    shutil.copy(session / "2/20/audio.wav", session / "2/30/audio.wav")
    sentence = fails("extract", session, tmp_path / "o.zarr", "--quiet", "--workers", 1)
    assert "the same bytes as" in sentence
    assert "2/20/audio.wav" in sentence
    assert "2/30/audio.wav" in sentence
    assert not (tmp_path / "o.zarr").exists()


@pytest.mark.parametrize(("one", "other"), [("2", "2.0"), ("2/20", "2/20.0"), ("2/20", "2/20.001")])
def test_one_texture_or_speed_under_two_names(fails, session, tmp_path, one, other):
    shutil.move(session / one, session / other)
    (session / "session.json").write_text("{}") if one == other else None
    name = "texture" if "/" not in one else "speed"
    if name == "texture":  # beside a folder of the other name
        shutil.copytree(session / other, session / one)
    sentence = fails("extract", session, tmp_path / "o.zarr", "--quiet")
    assert f"each {name} under one name, found" in sentence
    assert not (tmp_path / "o.zarr").exists()


def declare_checksums(session):
    from afferents.files import checksum

    sums = {}
    for path in session.glob("*/*/audio.wav"):
        sums.setdefault(f"{path.parent.parent.name}/{path.parent.name}", {})[path.name] = checksum(
            path
        )
    edited(session / "session.json", lambda c: c.update(checksums=sums))


def test_drums_swapped_in_a_session_that_declares_checksums(fails, run, session, tmp_path):
    declare_checksums(session)
    assert run("extract", session, tmp_path / "good.zarr", "--quiet", *ALONE)[0] == 0
    a, b = session / "1/20", session / "2/20"
    a.rename(session / "tmp"), b.rename(a), (session / "tmp").rename(b)
    sentence = fails("extract", session, tmp_path / "o.zarr", "--quiet", "--workers", "1")
    assert "expected the file whose checksum session.json declares, found another" in sentence


def test_a_session_file_that_is_mended_needs_no_other_store(fails, run, session, tmp_path):
    good = (session / "session.json").read_text()
    store = tmp_path / "o.zarr"
    edited(session / "session.json", lambda c: c.update(sample_rate_hz=16000))
    assert "at 16000 Hz" in fails("extract", session, store, "--quiet", "--workers", "1")
    (session / "session.json").write_text(good)
    assert run("extract", session, store, "--quiet", *ALONE)[0] == 0
    assert run("extract", session, tmp_path / "calm.zarr", "--quiet", *ALONE)[0] == 0
    contents = [{p.relative_to(root): p.read_bytes() for p in root.rglob("*") if p.is_file()}
                for root in (store, tmp_path / "calm.zarr")]  # fmt: skip
    assert contents[0] == contents[1]
    # What the declaration decides is worked out anew, and nothing else is.
    before = (store / "2/20/ra2/c/0/0").stat().st_mtime_ns
    assert run("extract", session, store, "--quiet", *ALONE)[0] == 0
    assert (store / "2/20/ra2/c/0/0").stat().st_mtime_ns == before
    edited(session / "session.json", lambda c: c.update(steady_s=[0.5, 2.5]))
    assert run("extract", session, store, "--quiet", *ALONE)[0] == 0
    attributes = json.loads((store / "2/20/zarr.json").read_text())["attributes"]
    assert attributes["steady_s"] == "[0.5, 2.5]"


def test_a_broken_recording_is_made_again(run, session, tmp_path):
    store = tmp_path / "o.zarr"
    assert run("extract", session, store, "--quiet", *ALONE)[0] == 0
    whole = (store / "2/20/ra2/c/0/0").read_bytes()
    shutil.rmtree(store / "2/20/ra2")
    (store / "2/30/zarr.json").unlink()
    (store / "1/20/ra2/zarr.json").write_text("{")
    assert run("extract", session, store, "--quiet", *ALONE)[0] == 0
    assert (store / "2/20/ra2/c/0/0").read_bytes() == whole
    assert len(open_data([str(store)])[0].responses) == len([*session.glob("*/*/audio.wav")])


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
        (attribute(speed_mm_s="fast"), "with speed_mm_s: "),
        (attribute(speed_mm_s=-5.0), "with speed_mm_s: "),
        (attribute(speed_mm_s=float("nan")), "no finite number"),
        (attribute(speed_mm_s=True), "with speed_mm_s: "),
        (attribute(texture=""), "with texture: "),
        (attribute(texture=5), "with texture: "),
        (attribute(name="2/30"), "their digest says so"),
        (attribute(steady_s="x"), "with steady_s: "),
        (attribute(steady_s="[3, 1]"), "with steady_s: "),
        (attribute(steady_s="[NaN, NaN]"), "with steady_s: "),
        (attribute(steady_s=5), "with steady_s: "),
        (attribute(conditions="[1]"), "with conditions: "),
        (of_array(attributes={"sample_rate_hz": 0}), "a sample_rate_hz from 1 to"),
        (of_array(attributes={"sample_rate_hz": "x"}), "a sample_rate_hz from 1 to"),
        (of_array(attributes={}), "the attribute 'sample_rate_hz'"),
        (of_array(attributes={"sample_rate_hz": 4000.0}), "their digest says so"),
        (of_array(data_type="int32"), "responses that can be read"),
        (of_array(data_type="qubit"), "responses that can be read"),
        (of_array(shape=[-1, 1]), "responses that can be read"),
        (of_array(zarr_format=9), "responses that can be read"),
        (of_array(codecs=[{"name": "evil"}]), "responses that can be read"),
    ],
)
def test_a_store_whose_metadata_changed_is_refused(store, change, sentence):
    change(store)
    with pytest.raises(InputError, match=r"2/20.*: expected .*found .*") as refused:
        open_data([str(store)])
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (values(lambda v: v + 1), "their digest says so"),
        (values(lambda v: v * np.nan), "1 chunks, found 0"),
        (values(lambda v: v + np.inf), "their digest says so"),
        (
            lambda store: shutil.copy(store / "2/30/ra2/c/0/0", store / "2/20/ra2/c/0/0"),
            "their digest says so",
        ),
    ],
)
def test_a_store_whose_values_changed_is_refused_when_they_are_read(
    fails, store, tmp_path, change, sentence
):
    change(store)
    out = ("--out", tmp_path / "r", "--quiet", "--workers", "1", "--models", "vib-te")
    said = fails("evaluate", store, *out)
    assert "2/20" in said
    assert sentence in said


def test_a_recording_of_a_store_copied_as_another(store):
    shutil.copytree(store / "2/20", store / "2/45")
    with pytest.raises(InputError, match="expected the responses of '2/45', found those of '2/20'"):
        open_data([str(store)])


def test_two_stores_of_one_recording(run, store, session, tmp_path):
    """Another extraction of the same files: other fingerprint, same recordings."""
    (session / "session.json").write_text(
        json.dumps({**json.loads((session / "session.json").read_text()), "steady_s": [0.4, 2.5]})
    )
    assert run("extract", session, tmp_path / "other.zarr", "--quiet", *ALONE)[0] == 0
    with pytest.raises(InputError, match="expected a recording of its own, found a copy of 1:"):
        open_data([str(store), str(tmp_path / "other.zarr")])


@pytest.mark.parametrize(
    "content",
    ["[" * 100_000, '{"attributes": [1]}', "", "{", '{"attributes": {"format": 5}}', b"\xff\xfe"],
)
def test_a_root_that_makes_no_sense(store, content):
    data = content if isinstance(content, bytes) else content.encode()
    (store / "zarr.json").write_bytes(data)
    with pytest.raises(InputError):
        open_data([str(store)])

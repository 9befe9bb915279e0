"""One sentence, exit code 2, no traceback, nothing half-written."""

import json
import shutil

import numpy as np
import pytest
import soundfile

ALONE = ("--quiet", "--workers", 1)


@pytest.fixture
def broken(sounds, tmp_path):
    """A copy of the session of sounds to break."""
    return shutil.copytree(sounds, tmp_path / "session")


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        (("status", "NONE"), "a results folder that evaluate has begun"),
        (("extract", "NONE", "OUT"), "expected a session folder, found no such folder"),
        (("reproduce", "OUT", "--session", "NONE", "--quiet"), "a session folder, found no such"),
        (("simulate", "OUT", "--textures", "z", "--quiet"), "found 'z'"),
        (("simulate", "OUT", "--speeds", "0", "--quiet"), "found 0"),
        (("simulate", "OUT", "--workers", "0"), "--workers: expected 1 or more, found 0"),
        (
            ("simulate", "OUT", "--seed", 2**32),
            "--seed: expected 0 to 4294967295, found 4294967296",
        ),
        (("train", "NONE", "OUT", "--seed", "-1"), "--seed: expected 0 to 4294967295, found -1"),
        (("extract", "NONE", "OUT", "--workers", "0"), "--workers: expected 1 or more"),
        (("track", "VIDEO", "OUT", "--workers", "-1"), "--workers: expected 1 or more, found -1"),
        (
            ("neural", "NONE", "--out", "OUT", "--window-s", "0"),
            "--window-s: expected 0.01 or more",
        ),
        (("neural", "NONE", "--out", "OUT", "--seed", "-1"), "--seed: expected 0 to"),
        (("export-nwb", "NONE", "OUT.nwb", "--seed", "-1"), "--seed: expected 0 to"),
        (
            ("benchmark", "run", "rig/speed", "--models", "chance", "--seeds", "0"),
            "--seeds: expected",
        ),
        (("live", "--video", "rig", "--web", "--port", "70000"), "--port: expected 0 to 65535"),
        (("drum", "g", "OUT", "--bore", "90"), "--bore"),
        (("calibrate", "none.mp4", "--out", "OUT.toml"), "none.mp4: expected a readable video"),
        (("calibrate", "none.mp4", "--out", "OUT.json"), "a name that ends in .toml"),
        (("calibrate", "a.mp4", "a.mp4", "--out", "OUT.toml"), "a.mp4: expected each clip once"),
        (("inspect", ".", "--overlay", "OUT.mp4"), "--overlay: expected a video"),
        (("inspect", "--", "-v.mp4", "--out", "OUT"), "--out: expected options before '--', found"),
        (("evaluate", "NONE", "--out", "OUT"), "a store written by 'afferents extract'"),
        (("evaluate", "NONE", "--out", "OUT", "--models", "rl-se"), "found 'rl-se'"),
        (("evaluate", "NONE", "--out", "OUT", "--without", "F250"), "NAME=VALUE"),
        (("track", "VIDEO", "OUT", "--cluster", "tcp://x:1"), "--cluster: expected a session"),
    ],
)
def test_a_command_that_can_not_go_on(fails, small_session, tmp_path, command, sentence):
    places = {"NONE": tmp_path / "none", "VIDEO": small_session / "1/20/video.mp4"}
    given = [places.get(w, str(w).replace("OUT", f"{tmp_path}/out")) for w in command]
    assert sentence in fails(*given)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("source", ["one.mcap", "folder", "."])
@pytest.mark.parametrize(
    "command",
    [
        ("extract", "BAG", "OUT"),
        ("track", "BAG", "OUT"),
        ("inspect", "BAG", "--out", "OUT"),
        ("evaluate", "BAG", "--out", "OUT"),
    ],
)
def test_a_bag_is_to_be_imported(fails, tmp_path, command, source):
    bags = tmp_path / "bags"
    (bags / "folder").mkdir(parents=True)
    (bags / "folder/metadata.yaml").touch()
    (bags / "one.mcap").touch()
    sentence = fails(*({"BAG": bags / source, "OUT": tmp_path / "out"}.get(w, w) for w in command))
    named = bags / ("folder" if source == "." else source)
    assert f"found a bag of ROS ({named.name}); 'afferents import {named} --session" in sentence
    assert [path.name for path in tmp_path.iterdir()] == ["bags"]


PUBLISHED = ("--models", "ridge-te", "--window-s", "0.5", "--protocol", "published")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--cut", "published"), "found 3.00 s; the cut 'all' takes"),
        (("--models", "ra-ste"), "(vib-te, vib-te-aug, ridge-te, order-te"),
        (("--textures", "2"), "at least 2 textures to recognise, found 2"),
        (("--speeds", "20"), "at least 3 speeds, to hold one out under nested, found 1 (20 mm/s);"),
        (("--speeds", "20,40"), "found 2 (20, 40 mm/s); record more speeds, or use --protocol pub"),
        ((*PUBLISHED, "--speeds", "20,40"), "at least 3 speeds, to hold one out, found 2"),
        ((*PUBLISHED, "--train-speeds", "1"), "as each is left out in its turn, found 1"),
        (("--models", "ridge-te", "--window-s", "1e-9"), "--window-s: expected at least two"),
        (("--stride-s", "1e-9"), "--stride-s: expected at least 0.001 s"),
        (("--models", "ridge-te", "--stride-s", "1e-9"), "--stride-s: expected at least 0.004 s"),
        (("--held-out", "25"), "--held-out: expected some of 20, 30, 40, 60 mm/s, found 25"),
        (("--models", "order-te-measured"), "order-te, order-te-speed-known"),
        (("--models", "fusion"), "found fusion, for which 1/20 lacks ra2 and sa1_vector"),
    ],
)
def test_data_that_models_can_not_learn_from(fails, stores, tmp_path, options, sentence):
    models = () if "--models" in options else ("--models", "vib-te")
    given = ("evaluate", stores["audio"], "--out", tmp_path / "r", *models, *ALONE)
    assert sentence in fails(*given, *options)


def test_keep_going_skips_names_and_exits_with_3(fails, broken, tmp_path):
    (broken / "2/30/audio.wav").write_bytes(b"not a wav")
    sentence = fails("extract", broken, tmp_path / "o.zarr", *ALONE, "--keep-going", code=3)
    assert "skipped 1 of the recordings: 2/30" in sentence
    assert sorted(p.name for p in (tmp_path / "o.zarr" / "2").glob("[0-9]*")) == ["20", "40", "60"]


def test_a_texture_of_which_nothing_can_be_read_leaves_no_group(fails, broken, tmp_path):
    for sound in (broken / "2").glob("*/audio.wav"):
        sound.write_text(f"not the wav {sound}")
    fails("extract", broken, tmp_path / "o.zarr", *ALONE, "--keep-going", code=3)
    assert not (tmp_path / "o.zarr" / "2").exists()
    assert (tmp_path / "o.zarr" / "1").exists()


def test_a_recording_too_short_for_a_window_is_skipped_and_said_so(fails, does, broken, tmp_path):
    soundfile.write(broken / "2/30/audio.wav", np.zeros((6800, 2)), 8000)  # 0.85 s
    declared = json.loads((broken / "session.json").read_text())
    (broken / "session.json").write_text(json.dumps(declared | {"steady_s": [0.2, 1.3]}))
    store, results = tmp_path / "s.zarr", tmp_path / "r"
    does("extract", broken, store, *ALONE)
    command = ("evaluate", store, "--out", results, "--models", "vib-te", *ALONE)
    said = "2/30: expected at least one window of 1 s, found 0.65 s; --window-s sets a shorter one"
    assert said in fails(*command)
    assert not (results / "summary.json").exists()
    quick = (*command, "--preset", "quick", "--keep-going")
    assert "skipped 1 of the recordings: 2/30" in fails(*quick, code=3)
    summary = json.loads((results / "summary.json").read_text())
    assert [entry["recording"] for entry in summary["skipped"]] == ["2/30"]
    does("report", results, "--quiet")
    page = (results / "report.html").read_text()
    assert "<strong>" in page.split("2/30")[0][-400:]


def test_debug_shows_the_traceback(run, tmp_path):
    assert "Traceback" in run("--debug", "inspect", tmp_path / "none")[2]


def test_memory_that_is_short_is_one_sentence_of_any_command(fails, monkeypatch, tmp_path):
    def short(*_):
        raise MemoryError

    monkeypatch.setattr("afferents.reproduction.status.status", short)
    assert fails("status", tmp_path).startswith("afferents: out of memory; ")

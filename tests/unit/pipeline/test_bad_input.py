"""One sentence, exit code 2, no traceback, nothing half-written."""

import json
import shutil
import sys

import numpy as np
import pytest
import soundfile

from afferents import cli


@pytest.fixture
def broken(sounds, tmp_path):
    """A copy of the small session to break."""
    return shutil.copytree(sounds, tmp_path / "session")


def test_missing_session(fails, tmp_path):
    assert "expected a session folder, found no such folder" in fails(
        "extract", tmp_path / "none", tmp_path / "o.zarr"
    )
    assert not (tmp_path / "o.zarr").exists()


def test_hole_in_the_grid(fails, broken, tmp_path):
    shutil.rmtree(broken / "2" / "30")
    sentence = fails("extract", broken, tmp_path / "o.zarr")
    assert "found none in 2/30" in sentence
    assert not (tmp_path / "o.zarr").exists()


def test_audio_of_another_rate(fails, broken, tmp_path):
    soundfile.write(broken / "2/30/audio.wav", np.zeros((48000, 2)), 16000)
    sentence = fails("extract", broken, tmp_path / "o.zarr", "--quiet", "--workers", 1)
    assert "2/30/audio.wav: expected 2 channel(s) at 8000 Hz, found 2 at 16000 Hz" in sentence


def test_keep_going_skips_names_and_exits_with_3(fails, broken, tmp_path):
    (broken / "2/30/audio.wav").write_bytes(b"not a wav")
    alone = ("--quiet", "--workers", 1)
    sentence = fails("extract", broken, tmp_path / "o.zarr", *alone, "--keep-going", code=3)
    assert "skipped 1 of the recordings: 2/30" in sentence
    assert sorted(p.name for p in (tmp_path / "o.zarr" / "2").glob("[0-9]*")) == ["20", "40", "60"]


def test_recordings_too_short_for_the_published_cut(fails, stores, tmp_path):
    command = ("evaluate", stores["audio"], "--out", tmp_path / "r", "--quiet")
    sentence = fails(*command, "--models", "vib-te", "--cut", "published")
    assert (
        "at least 60 s of audio for the cut 'published', found 3.00 s; the cut 'all' takes"
        in sentence
    )
    # What the data can't support is named with what they can.
    sentence = fails("evaluate", stores["audio"], "--out", tmp_path / "q", "--models", "ra-ste")
    assert "(vib-te, vib-te-aug, ridge-te, order-te" in sentence


def test_results_of_another_configuration(fails, stores, tmp_path):
    source = {"source": "s", "kind": "store", "fingerprint": "f", "n_recordings": 9}
    config = {"data": [{**source, "simulated": True}], "without": {}, "skipped": [], "spectral": {}}
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "config.json").write_text(
        json.dumps({**config, "cut": "published", "preset": "quick"})
    )
    sentence = fails("evaluate", stores["audio"], "--out", tmp_path / "r", "--quiet")
    assert "choose another place" in sentence
    assert [p.name for p in (tmp_path / "r").iterdir()] == ["config.json"]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--textures", "2"], "at least 2 textures to tell apart, found 2"),
        (["--speeds", "20"], "at least 3 speeds, to hold one out under nested, found 1 (20 mm/s);"),
        (["--speeds", "20,40"], "found 2 (20, 40 mm/s); record more speeds, or use --protocol pub"),
        (
            [
                "--models",
                "ridge-te",
                "--speeds",
                "20,40",
                "--protocol",
                "published",
                "--window-s",
                "0.5",
            ],
            "at least 3 speeds, to hold one out, found 2",
        ),
        (
            [
                "--models",
                "ridge-te",
                "--protocol",
                "published",
                "--train-speeds",
                "1",
                "--window-s",
                "0.5",
            ],
            "at least 2 speeds to learn from, as each is left out in its turn, found 1",
        ),
        (
            ["--models", "ridge-te", "--window-s", "1e-9"],
            "--window-s: expected at least two samples",
        ),
        (["--models", "vib-te", "--stride-s", "1e-9"], "--stride-s: expected at least 0.001 s"),
        (["--models", "ridge-te", "--stride-s", "1e-9"], "--stride-s: expected at least 0.004 s"),
        (["--models", "order-te-measured"], "order-te, order-te-speed-known"),
        (["--models", "fusion"], "found fusion, for which 1/20 lacks ra2 and sa1_vector"),
    ],
)
def test_data_that_models_can_not_learn_from(fails, stores, tmp_path, options, sentence):
    said = fails(
        "evaluate",
        stores["audio"],
        "--out",
        tmp_path / "r",
        "--models",
        "vib-te",
        "--workers",
        1,
        *options,
    )
    assert sentence in said


def test_unknown_names(fails, tmp_path):
    assert "found 'rl-se'" in fails("evaluate", tmp_path, "--out", tmp_path, "--models", "rl-se")
    assert "a store written by 'afferents extract'" in fails(
        "evaluate", tmp_path, "--out", tmp_path / "r"
    )
    assert "NAME=VALUE" in fails("evaluate", tmp_path, "--out", tmp_path / "r", "--without", "F250")


def test_a_csv_with_a_bad_row(fails, tmp_path):
    header = ",".join(
        ["timestamp", "proximity1", "proximity2", *(f"channel{i}" for i in range(1, 17))]
    )
    rows = [",".join(map(str, [28 * n, 0, 0, *range(16)])) for n in range(200)]
    rows[100] = rows[100].replace("7", "seven", 1)
    (tmp_path / "Linen_F120_V10mmps_0.csv").write_text("\n".join([header, *rows]))
    sentence = fails("evaluate", f"fabricslide:{tmp_path}", "--out", tmp_path / "r", "--quiet")
    assert "Linen_F120_V10mmps_0.csv" in sentence
    assert "102" in sentence


def test_debug_shows_the_traceback(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(sys, "argv", ["afferents", "--debug", "inspect", str(tmp_path / "none")])
    with pytest.raises(SystemExit):
        cli.main()
    assert "Traceback" in capsys.readouterr().err


def test_a_recording_too_short_for_a_window_is_skipped_and_said_so(
    fails, broken, tmp_path, monkeypatch, capsys
):
    soundfile.write(broken / "2/30/audio.wav", np.zeros((4000, 2)), 8000)
    store, results = tmp_path / "s.zarr", tmp_path / "r"
    monkeypatch.setattr(
        sys, "argv", ["afferents", "extract", str(broken), str(store), "--workers", "1"]
    )
    with pytest.raises(SystemExit):
        cli.main()
    command = ("evaluate", store, "--out", results, "--models", "vib-te", "--quiet", "--workers", 1)
    assert "2/30: expected at least one window of 1 s, found 0.33 s" in fails(*command)
    assert not (results / "summary.json").exists()
    assert "skipped 1 of the recordings: 2/30" in fails(*command, "--keep-going", code=3)
    summary = json.loads((results / "summary.json").read_text())
    assert [entry["recording"] for entry in summary["skipped"]] == ["2/30"]
    monkeypatch.setattr(sys, "argv", ["afferents", "report", str(results), "--quiet"])
    with pytest.raises(SystemExit):
        cli.main()
    page = (results / "report.html").read_text()
    assert "<strong>" in page.split("2/30")[0][-400:]


def test_a_rig_that_can_not_be(fails, tmp_path):
    session = tmp_path / "session"
    assert "found 'z'" in fails("simulate", session, "--textures", "z", "--quiet")
    assert "found 0" in fails("simulate", session, "--speeds", "0", "--quiet")
    assert "--bore" in fails("drum", "g", tmp_path / "g.stl", "--bore", "90")
    assert list(tmp_path.iterdir()) == []


def test_reproducing_from_no_session(fails, tmp_path):
    sentence = fails("reproduce", tmp_path / "out", "--session", tmp_path / "none", "--quiet")
    assert "expected a session folder, found no such folder" in sentence

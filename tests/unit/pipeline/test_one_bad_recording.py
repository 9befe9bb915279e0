"""One bad recording of many does not end a run: extract, evaluate and report go on without it."""

import json
import shutil

import pytest

from afferents.store import integrity

from ...conftest import few_epochs

ALONE = ("--quiet", "--workers", 1)


@pytest.fixture
def cut_off(sounds, tmp_path):
    """A session in which one recording's sound was cut off while it was copied."""
    root = shutil.copytree(sounds, tmp_path / "session")
    wav = root / "2/30/audio.wav"
    wav.write_bytes(wav.read_bytes()[:2000])
    return root


def test_through_extract_evaluate_and_report(cut_off, tmp_path, run, fails):
    store, results = tmp_path / "s.zarr", tmp_path / "r"
    assert "2/30" in fails("extract", cut_off, store, *ALONE, "--keep-going", code=3)
    command = ("evaluate", store, "--out", results, "--models", "vib-te", "--held-out", 30, *ALONE)
    assert "11 (2/30 missing); extract again, or use --keep-going" in fails(*command)
    with few_epochs():
        assert "skipped 1 of the recordings: 2/30" in fails(*command, "--keep-going", code=3)
    code, out, err = run("report", results, "--quiet")
    assert code == 0, err
    assert "1 recording is missing: 2/30." in " ".join(out.split())
    table = (results / "table1.md").read_text()
    assert "1 recording is missing: 2/30." in table
    page = (results / "report.html").read_text()
    assert "1 recording was skipped" in page
    folds = json.loads((results / "summary.json").read_text())["models"]["vib-te"]["nested"]
    assert folds["n_test"] == 2 * 4  # of the others at that speed


def test_damage_to_the_store_is_found_before_anything_is_trained(
    stores, tmp_path, fails, monkeypatch
):
    monkeypatch.setattr(integrity, "_SMALL", 0)  # long recordings are not read when they are opened
    store, results = shutil.copytree(stores["video"], tmp_path / "s.zarr"), tmp_path / "r"
    (chunk,) = [p for p in (store / "2/40/sa1/c").rglob("*") if p.is_file()][:1]
    chunk.write_bytes(chunk.read_bytes()[:-7])
    command = ("evaluate", store, "--out", results, "--models", "sa-wave", *ALONE)
    sentence = fails(*command, "--keep-going", code=3)
    assert (
        "skipped 1 of the recordings: 2/40 (sa1 of 2/40: expected data that can be read" in sentence
    )
    summary = json.loads((results / "summary.json").read_text())
    assert [one["recording"] for one in summary["skipped"]] == ["2/40"]

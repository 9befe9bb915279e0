"""A recording in rerun: every value of camera, markers, responses, sound and drum is logged."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from afferents import cli

pytest.importorskip("rerun")


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    root = tmp_path_factory.mktemp("view")
    session, store = root / "S", root / "S.zarr"
    for command in (
        ["simulate", session, "--textures", "4", "--speeds", "60", "--seconds", "2"],
        ["extract", session, store],
    ):
        cli.app([*map(str, command), "--workers", "1", "--quiet"], standalone_mode=False)
    return session, store


def contents_of(path):
    """Return what rerun says is in a file."""
    rerun = Path(sys.executable).parent / "rerun"
    command = [rerun, "rrd", "stats", path]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_all_of_a_session_and_its_store(rig, tmp_path, run):
    session, store = rig
    save = tmp_path / "touch.rrd"
    code, out, _ = run("view", session, "4/60", "--store", store, "--save", save, "--json")
    assert code == 0
    n = json.loads(out)["logged"]
    assert n["camera"] == n["camera/markers"] == n["sa1"] == n["ra1"] == 180
    assert n["microphone/dB"] == 200
    assert n["drum/speed_mm_s"] > 10
    said = contents_of(save)
    for entity in n:
        assert f"/{entity}:" in said


def test_a_store_alone(rig, tmp_path, run):
    code, out, _ = run("view", rig[1], "--save", tmp_path / "touch.rrd", "--json")
    n = json.loads(out)["logged"]
    assert code == 0
    assert "camera" not in n
    assert (n["sa1"], n["microphone/dB"]) == (180, 200)


def test_what_is_not_there_is_named(rig, stores, fails, tmp_path):
    session, _ = rig
    save = ("--save", tmp_path / "touch.rrd")
    assert "found '7/60'" in fails("view", session, "7/60", *save)
    assert "the recording '4/60'" in fails("view", session, "--store", stores["video"], *save)
    assert not save[1].exists()


def test_a_file_of_another_kind_is_not_replaced(rig, fails, tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("mine")
    assert "notes.txt" in fails("view", rig[1], "--save", notes)
    assert notes.read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]

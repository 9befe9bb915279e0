"""A recording in rerun: every value of camera, markers, responses, sound and drum is logged."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from afferents.robots.sources import Chosen
from afferents.robots.viewer import list_values

with_rerun = pytest.mark.skipif(find_spec("rerun") is None, reason="could not import 'rerun'")


def contents_of(path):
    """Return what rerun says is in a file."""
    rerun = Path(sys.executable).parent / "rerun"
    command = [rerun, "rrd", "stats", path]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@with_rerun
def test_all_of_a_session_and_its_store(simulated, tmp_path, does):
    session, store = simulated
    save = tmp_path / "touch.rrd"
    said = does("view", session, "4/60", "--store", store, "--save", save, "--json")
    n = json.loads(said)["logged"]
    assert n["camera"] == n["camera/markers"] == n["sa1"] == n["ra1"] == 180
    assert n["microphone/dB"] == 200
    assert n["drum/speed_mm_s"] > 10
    said = contents_of(save)
    for entity in n:
        assert f"/{entity}:" in said
    film = does("view", session, "--save", tmp_path / "film.rrd", "--json")
    assert json.loads(film)["logged"]["drum/speed_mm_s"] == n["drum/speed_mm_s"]


@with_rerun
def test_a_store_alone(simulated, tmp_path, does):
    said = does("view", simulated[1], "--save", tmp_path / "touch.rrd", "--json")
    n = json.loads(said)["logged"]
    assert "camera" not in n
    assert (n["sa1"], n["microphone/dB"]) == (180, 200)


def test_a_file_that_is_there_is_left(fails, tmp_path):
    save = tmp_path / "touch.rrd"
    save.write_text("precious")
    assert "a name that is free" in fails("view", tmp_path / "S", "--save", save)
    assert save.read_text() == "precious"


def test_markers_count_from_the_corner_of_the_first_pixel():
    position = (("time", "marker", "space"), [[[3.0, 4.0], [np.nan, np.nan]]])
    responses = xr.Dataset({"position": position}, {"time": [0.5]})
    rr = SimpleNamespace(Points2D=lambda points, **_: points.tolist())
    logged = [*list_values(rr, Chosen(None, responses))]
    assert logged == [(0.5, "camera/markers", [[3.5, 4.5]])]


@with_rerun
def test_what_is_not_there_is_named(simulated, stores, fails, tmp_path):
    session, _ = simulated
    save = ("--save", tmp_path / "touch.rrd")
    assert "found '7/60'" in fails("view", session, "7/60", *save)
    assert "the recording '4/60'" in fails("view", session, "--store", stores["video"], *save)
    assert not save[1].exists()

"""A data set from outside the package: through inspect, evaluate, report and train."""

import json
import re
import shutil
import sys
from pathlib import Path

import pytest

import afferents
from afferents.errors import InputError
from afferents.evaluation.data import open_data
from afferents.recordings.data_sets import Stored, data_set_of

OWN = Path(__file__).with_name("own_data.py")
MODEL = ("--models", "order-te", "--workers", "1", "--held-out", "30")


@pytest.fixture(scope="module")
def gloves(sounds, tmp_path_factory):
    """The sounds of a session under other names."""
    folder = tmp_path_factory.mktemp("own") / "gloves"
    folder.mkdir()
    for texture, cloth in (("1", "silk"), ("2", "wool"), ("3", "jute")):
        for speed in ("20", "30", "40", "60"):
            shutil.copy(sounds / texture / speed / "audio.wav", folder / f"{cloth}_{speed}.wav")
    return folder


@pytest.fixture
def own_data(monkeypatch):
    """The module, as a user imports it."""
    monkeypatch.syspath_prepend(str(OWN.parent))
    yield __import__("own_data")
    sys.modules.pop("own_data", None)


def test_it_goes_all_the_way_on_the_command_line(run, does, gloves, tmp_path):
    source = f"{OWN}:Gloves:{gloves}"
    out = does("inspect", source, "--out", tmp_path / "pictures", "--quiet")
    assert "12 recordings of 3 textures (jute, silk, wool) at 4 speeds" in out
    does("evaluate", source, "--out", tmp_path / "r", *MODEL, "--quiet")
    config = json.loads((tmp_path / "r" / "config.json").read_text())
    (data,) = config["data"]
    assert (data["kind"], data["source"], data["n_recordings"]) == ("gloves", source, 12)
    assert (config["spectral"]["window_s"], config["spectral"]["remove_mean"]) == (0.5, True)
    does("report", tmp_path / "r", "--quiet")
    page = (tmp_path / "r" / "report.html").read_text()
    assert f"evaluate --config {tmp_path}/r/config.json --out AGAIN" in page
    assert "Figures of the data are missing" not in page
    assert "Figure 12" in page
    asked = ("train", source, tmp_path / "m", "--model", "vib-te", "--preset", "quick", "--quiet")
    assert run(*asked, "--results", tmp_path / "r")[0] == 2  # another model was evaluated
    does(*asked)
    card = json.loads((tmp_path / "m" / "model.json").read_text())
    assert card["textures"] == ["jute", "silk", "wool"]
    assert card["encoding"]["window_s"] == 0.5
    assert card["data"][0]["fingerprint"] == data["fingerprint"]


def test_an_object_is_taken_where_a_path_is(gloves, own_data, tmp_path):
    mine = own_data.Gloves(gloves)
    options = {"models": "order-te", "workers": 1, "quiet": True}
    found = afferents.evaluate(mine, tmp_path / "r", held_out=[30.0], **options)
    assert found.summary["data"][0]["source"] == f"own_data:Gloves:{gloves}"
    page = afferents.report(tmp_path / "r", quiet=True).read_text()
    assert "Figures of the data are missing" not in page
    both = [own_data.Heard(gloves)]
    heard = afferents.evaluate(both, tmp_path / "heard", held_out=[30.0], **options)
    assert heard.summary["data"][0]["simulated"]
    assert (heard.accuracy["accuracy"] == found.accuracy["accuracy"]).all()
    assert afferents.samples(mine, "ra2", "spectral", quiet=True).sizes["sample"] == 12 * 6
    looked = afferents.inspect(own_data.Heard(gloves), tmp_path / "looked", quiet=True)
    assert looked.sentences[0] == "gloves of 12 recordings with ra2."


def test_one_made_in_a_notebook_is_evaluated_and_its_report_says_what_it_lacks(
    gloves, own_data, tmp_path
):
    class Here(own_data.Gloves):
        name, title = "here", "here"

    options = {"models": "order-te", "workers": 1, "held_out": [30.0], "quiet": True}
    found = afferents.evaluate(Here(gloves), tmp_path / "r", **options)
    assert found.summary["data"][0]["source"] == f"here:{gloves}"
    page = afferents.report(tmp_path / "r", quiet=True).read_text()
    assert "Figures of the data are missing" in page


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("no_data_set", "expected an afferents.DataSet at .*, or a class of them and a path"),
        ("Gloves", "expected an afferents.DataSet at .*, or a class of them and a path"),
        ("Twice:PATH", "expected recordings of different names, found several 'run'"),
        ("Strange:PATH", "options of the encoding 'spectral'"),
    ],
)
def test_what_is_wrong_with_one_is_said(fails, gloves, tmp_path, name, sentence):
    source = f"{OWN}:{name.replace('PATH', str(gloves))}"
    assert re.search(sentence, fails("evaluate", source, "--out", tmp_path / "r", *MODEL))
    assert not (tmp_path / "r").exists()


def test_a_file_that_its_author_can_t_read_is_named_and_may_be_skipped(gloves, own_data, tmp_path):
    folder = shutil.copytree(gloves, tmp_path / "g")
    shutil.copy(folder / "silk_20.wav", folder / "odd.wav")
    with pytest.raises(InputError, match=r"expected data that can be read, found ValueError: not"):
        open_data([own_data.Gloves(folder)])
    (folder / "odd.wav").rename(folder / "silk_80.wav")
    (folder / "silk_80.wav").write_bytes(b"RIFF")
    with pytest.raises(InputError, match=r"silk_80\.wav"):
        open_data([own_data.Gloves(folder)])
    (opened,) = open_data([own_data.Gloves(folder)], keep_going=True)
    assert list(opened.failed) == ["silk_80"]
    assert opened.origin.n_recordings == 12


def test_which_one_a_path_is_of(stores, sounds, tmp_path):
    assert isinstance(data_set_of(stores["audio"]), Stored)
    assert data_set_of(sounds).name == "session"
    assert data_set_of(f"session:{tmp_path}").name == "session"
    assert data_set_of(f"fabricslide:{tmp_path}").path == tmp_path
    (tmp_path / "data" / "fabric").mkdir(parents=True)
    (tmp_path / "data" / "fabric" / "Linen_F120_V10mmps_0.csv").touch()
    assert data_set_of(str(tmp_path)).name == "fabricslide"
    with_colon = tmp_path / "a:b"
    with_colon.mkdir()
    assert data_set_of(with_colon).path == with_colon

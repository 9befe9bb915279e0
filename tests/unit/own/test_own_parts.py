"""One of each from outside the package: through evaluate, report, train, export and live."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from torch import nn

import afferents
from afferents import Model
from afferents.channels import Ra1, name_of_channel
from afferents.encodings.settings import Encodings
from afferents.errors import AfferentsError, InputError
from afferents.evaluation import fold_files, train
from afferents.evaluation.results import PROBABILITY
from afferents.models.export import write_onnx
from afferents.plugins import named

OWN = Path(__file__).with_name("own_parts.py")


@pytest.fixture
def stored(stores):
    return stores["video"]


@pytest.fixture
def evaluated(run, stored, tmp_path):
    def evaluate(*names, out=tmp_path / "r", **options):
        models = ",".join(f"{OWN}:{name}" if ":" not in name else name[1:] for name in names)
        given = [text for name, value in options.items() for text in (f"--{name}", value)]
        return run("evaluate", stored, "--out", out, "--models", models, *given)

    return evaluate


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A folder of results that several tests go on in, so that ours is trained once."""
    return tmp_path_factory.mktemp("shared") / "r"


@pytest.mark.system
def test_they_go_all_the_way_beside_ours(run, does, evaluated, stored, tmp_path, session):
    code, out, err = evaluated("logistic", "mlp", "mine", "second", ":sa-wave", protocol="both")
    assert code == 0, err
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    wanted = {"logistic", "mlp", "all-mine", "second-net", "sa-wave"}
    assert set(summary["models"]) == wanted
    for name, of_protocol in summary["models"].items():
        nested = of_protocol["nested"]
        assert not any(nested["leaks"].values()), name
        assert len(nested["ci95"]) == 2
    table = pd.read_parquet(tmp_path / "r" / "predictions.parquet")
    of_mine = table[table["model"] == "logistic"].filter(regex=f"^{PROBABILITY}")
    np.testing.assert_allclose(of_mine.sum(axis=1), 1, atol=1e-3)
    does("report", tmp_path / "r", "--quiet")
    page = (tmp_path / "r" / "report.html").read_text()
    assert all(name in page for name in wanted - {"sa-wave", "mlp"})
    assert "a perceptron" in page  # what its title is
    assert "a perceptron" in (tmp_path / "r" / "table1.md").read_text()
    assert "mlp" not in (tmp_path / "r" / "table1.md").read_text()
    # A model of waves learns from 10 frames at once, theirs from single ones.
    does("train", stored, tmp_path / "m", "--model", f"{OWN}:mine", "--preset", "quick", "--quiet")
    card = json.loads((tmp_path / "m" / "model.json").read_text())
    assert card["channel"] == "own_parts:Height"
    assert card["encoding"] == {"name": "own_parts:Columns", "power": 1.0}
    assert card["classifier"] == "own_parts:perceptron"
    does("export", tmp_path / "m", tmp_path / "m.onnx")
    out = does(
        "live", "--model", tmp_path / "m.onnx", "--video", f"replay:{session}/1/20", "--json",
        "--speed", "inf",
    )  # fmt: skip
    said = [json.loads(line) for line in out.splitlines()]
    felt = [percept for percept in said if percept["state"] == "texture"]
    assert felt
    assert all(math.isclose(sum(p["probabilities"].values()), 1, abs_tol=1e-4) for p in felt)
    assert run("explain", tmp_path / "m", stored, "--out", tmp_path / "why", "--quiet")[0] == 2


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("raises", "the classifier Rude: ValueError: no, thank you"),
        ("sums", "expected probabilities that sum to 1, found a row that is off by 1"),
        ("nans", "expected probabilities, found values that are negative, infinite or no numbers"),
        ("shapes", "expected probabilities of shape ("),
        ("misshapen", "the classifier two_logits: expected logits of shape (2, 3) of 2 samples"),
    ],
)
def test_what_a_classifier_does_wrong_is_one_sentence_and_nothing_else_is_lost(
    evaluated, shared, name, sentence
):
    code, _, err = evaluated(":sa-wave", name, out=shared, workers="1")
    assert code == 2
    said = err.splitlines()[-1]
    assert said.startswith(f"afferents: {name}, nested, seed 0, 20 mm/s held out: ")
    assert sentence in said
    assert len(list(shared.rglob("fold.json"))) == 3


@pytest.mark.parametrize(
    ("where", "sentence"),
    [
        (f"{OWN}:nobody", "expected 'nobody' in own_parts, found nothing of that name"),
        (f"{OWN}:no_model", "expected an afferents.Model at"),
        (f"{OWN}:taken", "a name that no model of this package has, found 'ra-se'"),
        ("nowhere.py:mine", "nowhere.py:mine: expected a Python file, found no such file"),
        ("no_such_module:mine", "expected a module that can be imported, found ModuleNotFound"),
    ],
)
def test_what_is_not_there_is_named(fails, stored, tmp_path, where, sentence):
    assert sentence in fails("evaluate", stored, "--out", tmp_path / "r", "--models", where)
    assert not (tmp_path / "r").exists()


def test_files_of_one_name_are_told_apart_and_modules_are_not_hidden(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "parts_of_mine.py").write_text(f"where = '{folder}'\n")
    found = [named(f"{tmp_path}/{folder}/parts_of_mine.py:where") for folder in "abaab"]
    assert found == ["a", "b", "a", "a", "b"]
    (tmp_path / "random.py").write_text("mine = 1\n")
    with pytest.raises(InputError, match=r"random.py:mine: .* name of a module, found random; re"):
        named(f"{tmp_path}/random.py:mine")


@pytest.mark.system
def test_a_model_of_a_file_is_exported_by_another_process(does, stored, tmp_path):
    """From the folder of the file, as a user would; and a card names modules, never files."""
    shutil.copy(OWN, tmp_path / "my_models.py")
    asked = ("--model", f"{tmp_path}/my_models.py:mlp", "--preset", "quick", "--quiet")
    does("train", stored, tmp_path / "m", *asked)

    def export(folder):
        folder.mkdir(exist_ok=True)
        command = [sys.executable, "-m", "afferents", "export", tmp_path / "m", "m.onnx"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        return done.returncode, done.stderr

    assert export(tmp_path)[0] == 0
    assert (tmp_path / "m.onnx").is_file()
    code, said = export(tmp_path / "elsewhere")
    assert code == 2
    assert "expected a module that can be imported, found ModuleNotFoundError" in said
    card = json.loads((tmp_path / "m" / "model.json").read_text())
    card["classifier"] = f"{tmp_path}/my_models.py:perceptron"
    (tmp_path / "m" / "model.json").write_text(json.dumps(card))
    code, said = export(tmp_path / "elsewhere")
    assert code == 2
    assert "expected a module that can be imported" in said


def test_channels_that_were_made_otherwise_are_others():
    class Scaled(Ra1):
        def __init__(self, by):
            self.by = np.array(by)

    assert Scaled([1, 2]) == Scaled([1, 2]) != Scaled([1, 3])
    assert hash(Scaled([1])) == hash(Scaled([1]))
    with pytest.raises(InputError, match=r"without arguments, found Scaled\(by=\[1, 2\]\)"):
        name_of_channel(Scaled([1, 2]))


def test_a_model_whose_channel_or_encoding_changes_is_another(tmp_path, monkeypatch):
    def keep(by):
        monkeypatch.setattr(fold_files.files, "checksum", lambda path: f"{path.name} {by}")
        fold_files.keep_own_models(tmp_path, [named(f"{OWN}:mine")], Encodings())

    keep(1)
    keep(2)  # it has learnt nothing yet
    (tmp_path / "folds" / "all-mine").mkdir(parents=True)
    (tmp_path / "folds" / "all-mine" / "20.checkpoint").touch()
    keep(2)
    kept = json.loads((tmp_path / "own_models.json").read_text())["all-mine"]
    assert kept["own"] == {"Height()": "own_parts.py 2", "columns": "own_parts.py 2"}
    with pytest.raises(InputError, match="found those of another that had its name"):
        keep(3)


def test_a_part_that_no_card_can_name_is_refused_before_the_training(stored, tmp_path, monkeypatch):
    class Mine(Ra1):
        name = "mine"

    monkeypatch.setattr(train.fitting, "fit_once", None)
    mine = Model("m", channel=Mine(), encoding="spatial", classifier=named(f"{OWN}:perceptron"))
    with pytest.raises(
        InputError, match=r"channel: expected one of a module .* put it into a file"
    ):
        afferents.train(stored, tmp_path / "m", mine, quiet=True)


def test_a_module_that_pytorch_can_not_export_is_one_sentence(tmp_path):
    class Branches(nn.Module):
        def forward(self, x):
            return (x, x) if x.sum().item() > 0 else (2 * x, x)

    with pytest.raises(AfferentsError, match="export: expected a module that PyTorch can export"):
        write_onnx(Branches(), (torch.ones(1, 3),), tmp_path / "m.onnx")

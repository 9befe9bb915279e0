"""A scikit-learn estimator is trained, kept without a pickle, and read back as it was."""

import json
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from sklearn.linear_model import LogisticRegression
from skops.io import dump

import afferents
from afferents import cli
from afferents.errors import InputError
from afferents.models.folder import load_model
from afferents.plugins import named

OWN = Path(__file__).with_name("own_parts.py")
ASK = """
import sys, numpy as np, torch
from pathlib import Path
from afferents.models.folder import load_model
for model in map(Path, sys.argv[1:]):
    card, deployed = load_model(model)
    samples = np.random.default_rng(0).random((20, *card.shape), np.float32)
    with torch.no_grad():
        probabilities, novelty = deployed(torch.from_numpy(samples))
    np.savez(f"{model.name}.npz", probabilities=probabilities, novelty=novelty)
"""


@pytest.fixture(scope="module")
def trained(stores, tmp_path_factory):
    """A folder of trained models; the first through Python, the others by the command line."""
    root = tmp_path_factory.mktemp("estimators")
    model = named(f"{OWN}:logistic")
    afferents.train(stores["video"], root / "logistic", model=model, quiet=True)
    for name in ("forest", "nearest", "scaled"):
        command = ["afferents", "train", stores["video"], root / name, "--quiet"]
        cli.run([*map(str, command[1:]), "--model", f"{OWN}:{name}"])
    return root


@pytest.fixture
def model(trained, tmp_path):
    """A copy of one that a test may spoil."""
    return Path(shutil.copytree(trained / "logistic", tmp_path / "model"))


@pytest.mark.system
def test_another_process_gets_the_same_probabilities(trained, tmp_path):
    shutil.copy(OWN, tmp_path)
    names = ("logistic", "forest", "nearest", "scaled")
    command = [sys.executable, "-c", ASK, *(trained / name for name in names)]
    subprocess.run([*map(str, command)], cwd=tmp_path, check=True)
    for name in names:
        card, deployed = load_model(trained / name)
        samples = np.random.default_rng(0).random((20, *card.shape), np.float32)
        with torch.no_grad():
            here = deployed(torch.from_numpy(samples))
        there = np.load(tmp_path / f"{name}.npz")
        for one, kept in zip(here, ("probabilities", "novelty"), strict=True):
            np.testing.assert_allclose(one.numpy(), there[kept], rtol=1e-6, err_msg=name)
        np.testing.assert_allclose(there["probabilities"].sum(axis=1), 1, atol=1e-5)


def test_what_is_kept_are_the_estimator_s_answers_at_the_card_s_temperature(trained, stores):
    card, deployed = load_model(trained / "logistic")
    samples = afferents.samples(stores["video"], "ra1", "spatial", quiet=True)
    held = samples[samples.speed_mm_s == card.validated_on_mm_s]
    fitted = deployed.network.fitted
    said = fitted.predict_proba(held.values.reshape(len(held), -1))
    with torch.no_grad():
        probabilities = deployed(torch.from_numpy(held.values))[0].numpy()
    expected = np.maximum(said, 1e-12) ** (1 / card.temperature)
    expected /= expected.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(probabilities, expected, atol=1e-4)
    right = np.array(card.textures)[probabilities.argmax(axis=1)] == held.texture.values
    # One of both is in double precision, which decides between two textures for a few.
    assert card.validation_accuracy == pytest.approx(right.mean(), abs=2 / len(right))
    learnt = samples[samples.speed_mm_s != card.validated_on_mm_s]
    again = LogisticRegression(max_iter=50).fit(
        learnt.values.reshape(len(learnt), -1), learnt.texture
    )
    np.testing.assert_allclose(again.coef_, fitted.coef_, atol=1e-6)


def test_the_card_names_the_estimator_and_what_of_it_is_one_s_own(trained):
    cards = {path.parent.name: json.loads(path.read_text()) for path in trained.rglob("model.json")}
    assert cards["logistic"]["classifier"] == "sklearn.linear_model._logistic:LogisticRegression"
    assert cards["logistic"]["estimator"] == cards["forest"]["estimator"] == []
    assert cards["nearest"]["classifier"] == "own_parts:Nearest"
    assert cards["scaled"]["estimator"] == ["own_parts:Nearest"]
    assert cards["forest"]["title"] == "some trees"
    assert cards["forest"]["preset"] is None
    assert "scikit-learn" in cards["forest"]["versions"]
    card, _ = load_model(trained / "forest")
    assert "can't be exported or run live" in card.describe()[-1]


def test_it_is_explained_but_not_exported(does, fails, trained, stores, tmp_path):
    asked = ("explain", trained / "logistic", stores["video"], "--out", tmp_path / "why", "--quiet")
    does(*asked)
    sentence = fails("export", trained / "logistic", tmp_path / "m.onnx")
    assert "expected a model whose classifier is a torch module" in sentence


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: dump(named(f"{OWN}:Nearest")(), path),  # its card says sklearn alone
        lambda path: dump({"estimator": 3}, path),
        lambda path: dump(LogisticRegression(), path),  # has learnt nothing
        lambda path: path.write_bytes(pickle.dumps(LogisticRegression())),
        lambda path: path.write_bytes(path.read_bytes()[:-50]),
        lambda path: path.unlink(),
    ],
)
def test_what_is_not_as_it_was_kept_is_refused(model, spoil):
    spoil(model / "estimator.skops")
    with pytest.raises(InputError, match="estimator"):
        load_model(model)


@pytest.mark.parametrize("own", ["subprocess:Popen", "os:system", "own_parts:doubled", "gone:Mine"])
def test_a_card_cannot_have_anything_but_estimators_trusted(model, own):
    card = json.loads((model / "model.json").read_text())
    (model / "model.json").write_text(json.dumps(card | {"estimator": [own]}))
    with pytest.raises(InputError, match=r"estimator|imported"):
        load_model(model)


def test_a_type_that_the_card_does_not_name_is_never_made(model, tmp_path, monkeypatch):
    """A file that names something harmful is refused before that is imported."""
    (tmp_path / "harm.py").write_text(
        "from pathlib import Path\nPath('harmed').touch()\n"
        "from sklearn.linear_model import LogisticRegression\n"
        "class Harm(LogisticRegression): pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    from harm import Harm

    dump(Harm().fit([[0.0], [1.0]], [0, 1]), model / "estimator.skops")
    del sys.modules["harm"]
    (tmp_path / "harmed").unlink()
    with pytest.raises(InputError, match="harm"):
        load_model(model)
    assert not (tmp_path / "harmed").exists()


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("with_function", r"estimators of a module of your own.*doubled"),
        ("raises", "the classifier Rude: ValueError: no, thank you"),
    ],
)
def test_what_could_not_be_trusted_again_is_not_written(fails, stores, tmp_path, name, sentence):
    asked = ("train", stores["video"], tmp_path / "m", "--quiet", "--model", f"{OWN}:{name}")
    assert re.search(sentence, fails(*asked))
    assert not (tmp_path / "m").exists()


def test_a_class_in_place_of_an_estimator_is_refused(stores, tmp_path):
    model = afferents.Model("c", channel="sa1", encoding="spatial", classifier=LogisticRegression)
    with pytest.raises(InputError, match="a scikit-learn estimator with predict_proba"):
        afferents.train(stores["video"], tmp_path / "m", model=model, quiet=True)

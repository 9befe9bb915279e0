import errno
import json
from operator import setitem

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.evaluation import fold_files
from afferents.evaluation.fold_files import FoldKey
from afferents.evaluation.intervals import numbered
from afferents.evaluation.metrics import summarise
from afferents.evaluation.results import load_results
from afferents.folds.splits import Leaks, LeaveOneSpeedOut

SOURCE = {"source": "s", "kind": "store", "fingerprint": "f", "n_recordings": 6}
SOURCE |= {"simulated": False}
CONFIG = {"schema": 3, "data": [SOURCE], "without": {}, "skipped": [], "cut": "all"}
CONFIG |= {"preset": "quick", "spectral": {}}
ABOUT = {"afferents": "0", "data": [SOURCE], "cut": "all", "preset": "quick"}
ABOUT |= {"schema": 3, "speeds_mm_s": [10.0, 20.0, 30.0], "skipped": []}
EPOCHS = [
    {"accuracy": 0.5, "validation_accuracy": 0.4},
    {"accuracy": 0.9, "validation_accuracy": 0.6},
]
FACTS = {"validated_by": 20.0, "validation_accuracy": 0.5, "epochs": 2, "seconds": 1.5}
FACTS |= {"best_epoch": 2, "history": EPOCHS}
LEAKS = Leaks(0, 4, 0, 2, True)


def facts(key):
    content = {**key.content(), **FACTS, "leaks": LEAKS.describe(key.split)}
    return fold_files.FoldFacts.model_validate(content)


def save_all(root, data, accuracy_of):
    """Save a fold a speed; `accuracy_of[speed]` of the samples are named rightly."""
    keys = []
    for fold in LeaveOneSpeedOut().folds(data):
        key = FoldKey.of("vib-te", "nested", 0, fold.held_out)
        true = (data["texture"].values[fold.test] == "b").astype(int)
        right = np.arange(len(true)) < accuracy_of[fold.held_out] * len(true)
        probabilities = np.eye(2, dtype=np.float32)[np.where(right, true, 1 - true)]
        predictions = fold_files.predictions_table(key, data, fold, probabilities)
        fold_files.save_fold(root, facts(key), predictions, b"w")
        keys.append(key)
    return keys


def test_summary_and_predictions(tmp_path, samples):
    data = samples((10, 20, 30), n=5)
    fold_files.claim_results_folder(tmp_path, CONFIG)
    keys = save_all(tmp_path, data, {10: 0.5, 20: 1.0, 30: 0.0})
    assert fold_files.finished_keys(tmp_path) == keys
    summarise(tmp_path, keys, ["a", "b"], ABOUT)
    results = load_results(tmp_path)
    entry = results.summary["models"]["vib-te"]["nested"]
    assert entry["mean_accuracy"] == pytest.approx(0.5)
    assert entry["by"] == {"10": 0.5, "20": 1.0, "30": 0.0}
    assert entry["worst"] == "30"
    assert entry["best_epoch"] == {"10": [2], "20": [2], "30": [2]}
    assert results.summary["intervals"] == {"replicate": "texture", "n": 2}
    for found in (entry, entry["inside"], entry["recordings"]):
        assert found["ci95_by"].keys() == found["by"].keys()
    assert entry["ci95_by"]["20"] == [1.0, 1.0]
    assert entry["first_epoch"]["10"] == [{"training": 0.5, "validation": 0.4}]
    assert entry["n_test"] == len(results.predictions) == 30
    assert entry["leaks"]["test_samples_of_a_speed_seen_in_validation"] == 12
    assert entry["leaks"]["scale_saw_held_out_speed"] is True
    assert list(results.predictions.columns) == [
        "model", "protocol", "seed", "held_out_speed_mm_s", "recording", "start_s", "stop_s",
        "true_texture", "predicted_texture", "p_a", "p_b",
    ]  # fmt: skip


def test_of_several_sources_each_is_a_session(tmp_path, samples):
    fold_files.claim_results_folder(tmp_path, CONFIG)
    data = samples((10, 20, 30), n=4)
    session = np.arange(data.sizes["sample"]) % 2 + 1
    names = [numbered(str(n), k) for n, k in zip(data["recording"].values, session, strict=True)]
    keys = save_all(
        tmp_path, data.assign_coords(recording=("sample", names)), {10: 0.5, 20: 1.0, 30: 0.0}
    )
    about = {**ABOUT, "data": [SOURCE, {**SOURCE, "fingerprint": "other"}]}
    found = summarise(tmp_path, keys, ["a", "b"], about).intervals
    assert (found.bootstrap_unit, found.n) == ("session", 2)


def test_a_fold_that_fails_while_saving_is_not_finished(tmp_path, monkeypatch):
    key = FoldKey.of("vib-te", "nested", 0, 10.0)

    def fail(path, content):
        raise OSError(errno.ENOSPC, "disk full")

    monkeypatch.setattr("afferents.files.write_json", fail)
    with pytest.raises(InputError, match="no space left on the disk"):
        fold_files.save_fold(tmp_path, facts(key), pd.DataFrame({"a": [1]}), b"w")
    assert not fold_files.finished(tmp_path, key)
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_results_of_another_configuration_are_refused(tmp_path):
    fold_files.claim_results_folder(tmp_path / "r", CONFIG)
    fold_files.check_results_folder(
        tmp_path / "r", {**CONFIG, "data": [{**SOURCE, "source": "./s"}]}
    )
    with pytest.raises(InputError, match=r"cut published.*found results of another \(cut all\)"):
        fold_files.check_results_folder(tmp_path / "r", {**CONFIG, "cut": "published"})
    with pytest.raises(InputError, match="found results of another"):  # of who was slower
        fold_files.claim_results_folder(tmp_path / "r", {**CONFIG, "cut": "published"})


def test_a_digest_tells_configurations_and_not_where_data_lie():
    one, other = (
        {"cut": "all", "data": [{"source": "s"}]},
        {"data": [{"source": "t"}], "cut": "all"},
    )
    assert fold_files.config_digest(one) == fold_files.config_digest(other)
    assert fold_files.config_digest(one) != fold_files.config_digest({**one, "cut": "published"})


def test_a_folder_of_something_else_is_refused_and_checking_claims_nothing(tmp_path):
    killed = ("plan.json", "own_models.json", ".partial-plan.json-1", ".partial-config.json-2")
    for name in killed:
        (tmp_path / name).touch()
    fold_files.check_results_folder(tmp_path, {"cut": "all"})
    fold_files.check_results_folder(tmp_path / "r", {"cut": "all"})
    assert not (tmp_path / "r").exists()
    (tmp_path / "thesis.txt").write_text("precious")
    with pytest.raises(InputError, match="something else"):
        fold_files.check_results_folder(tmp_path, {"cut": "all"})


@pytest.fixture
def evaluated(tmp_path, samples):
    """A results folder, and how to change what a file of it says."""
    fold_files.claim_results_folder(tmp_path, CONFIG)
    keys = save_all(tmp_path, samples((10, 20, 30)), {10: 0.5, 20: 1.0, 30: 0.0})
    summarise(tmp_path, keys, ["a", "b"], ABOUT)

    def change(name, change):
        content = json.loads((tmp_path / name).read_text())
        change(content)
        (tmp_path / name).write_text(json.dumps(content))
        return tmp_path

    return change


def outcome(summary):
    return summary["models"]["vib-te"]["nested"]


SUMMARY, FOLD = "summary.json", "folds/vib-te/nested/seed-0/10/fold.json"


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        (SUMMARY, lambda c: c.update(schema=99), "with schema: 3, found 99"),
        (
            SUMMARY,
            lambda c: setitem(c["models"], "vib-te", {"by-guess": outcome(c)}),
            "'nested' or 'published', found 'by-guess'",
        ),
        ("config.json", lambda c: c.update(ablation={"noses": 3}), "unknown key 'ablation.noses'"),
        (FOLD, lambda c: c.update(model="a/b"), "model: "),
    ],
)
def test_what_makes_no_sense_is_named(evaluated, name, change, said):
    root = evaluated(name, change)
    with pytest.raises(InputError, match=name) as caught:
        fold_files.finished_keys(root) if name == FOLD else load_results(root)
    assert said in str(caught.value)


def test_results_of_a_reproduction_lie_one_folder_below(tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "summary.json").touch()
    with pytest.raises(InputError, match="; its results are in "):
        load_results(tmp_path)


def test_a_file_that_holds_no_predictions(evaluated):
    root = evaluated("config.json", lambda _: None)
    (root / "predictions.parquet").write_bytes(b"broken")
    with pytest.raises(InputError, match=": expected a table of predictions, found"):
        load_results(root)

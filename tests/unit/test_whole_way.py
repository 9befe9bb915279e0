"""Raw mp4 and wav in, Table 1 out, through the command line as a user would."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from ..conftest import few_epochs

pytestmark = pytest.mark.system

ALONE = ("--quiet", "--workers", 1)


@pytest.fixture
def evaluate(does, tmp_path):
    """Evaluate vib-te, or what is asked for, quietly; return what it says as JSON."""

    def of(*stores, out="r", models="vib-te", more=()):
        given = ("--out", tmp_path / out, "--models", models, *ALONE, "--json", *more)
        said = does("evaluate", *stores, *given)
        return json.loads(said)

    return of


def test_all_models_both_protocols_then_a_report(stores, tmp_path, does, evaluate):
    results = tmp_path / "r"
    options = ("--window-s", 0.2, "--stride-s", 0.1, "--protocol", "both")
    with few_epochs():  # none of the frames, whose accuracy is asked for below
        summary = evaluate(stores["video"], models="best,all", more=options)
    assert list(summary["models"]) == [
        "sa-se", "ra-se", "sa-ste", "ra-ste", "vib-te", "vib-te-aug", "sa-wave-vector",
    ]  # fmt: skip
    assert json.loads((results / "summary.json").read_text()) == summary
    for model, entry in summary["models"].items():
        assert not any(entry["nested"]["leaks"].values())
        picked = entry["published"]["leaks"]["test_samples_of_a_speed_seen_in_validation"] > 0
        assert picked is (model != "sa-wave-vector"), "nothing picks what is solved at once"
        assert set(entry["nested"]["by"]) == {"20", "40", "60"}
        low, high = entry["nested"]["ci95"]
        assert 0 <= low <= entry["nested"]["mean_accuracy"] <= high <= 1
    # Frames 16 to 44 of 9 recordings: nested tests them all, published the odd ones.
    assert summary["models"]["sa-se"]["nested"]["n_test"] == 9 * 29
    assert summary["models"]["sa-se"]["published"]["n_test"] == 9 * 14
    # How far the discs are pulled tells these textures apart at any speed.
    assert summary["models"]["sa-se"]["nested"]["mean_accuracy"] > 0.8

    does("report", results, "--quiet")
    page = (results / "report.html").read_text()
    for figure in (8, 9, 10, 11, 12, 13):
        assert f"Figure {figure}" in page
    assert not re.search(r"(src|href)=\"https?:", page)
    assert "no reproduction" in page


def test_finished_folds_are_not_trained_again(stores, tmp_path, run, evaluate):
    results = tmp_path / "r"
    first = evaluate(stores["audio"], more=("--held-out", "20,60"))
    assert list(first["models"]["vib-te"]["nested"]["by"]) == ["20", "60"]
    assert first["options"] == {"held_out": [20, 60]}
    kept = results / "folds/vib-te/nested/seed-0/20/weights.safetensors"
    before = kept.stat().st_mtime_ns
    whole = evaluate(stores["audio"])
    lost = results / "folds/vib-te/nested/seed-0/40"
    shutil.rmtree(lost)
    assert json.loads(run("status", results, "--json")[1])["counts"] == {
        "done": 3, "running": 0, "to do": 1, "failed": 0, "stopped": 0,
    }  # fmt: skip
    assert "goes on where it stopped" in run("status", results)[1]
    again = evaluate(stores["audio"])
    assert kept.stat().st_mtime_ns == before
    assert lost.is_dir()
    for summary in (whole, again):
        summary["models"]["vib-te"]["nested"].pop("seconds")
    assert again == whole
    assert "4 of 4 trainings are done." in run("status", results)[1]


def test_the_precision_asked_for_is_the_one_of_the_folds(stores, tmp_path, fails, evaluate):
    asked = ("--held-out", 30, "--precision", "bfloat16")
    evaluate(stores["audio"], more=asked)
    fold = json.loads((tmp_path / "r/folds/vib-te/nested/seed-0/30/fold.json").read_text())
    assert fold["precision"] == "bfloat16"
    command = ("evaluate", stores["audio"], "--out", tmp_path / "r", "--models", "vib-te")
    more = ("--preset", "quick", "--held-out", 30, "--precision", "float32")
    assert "precision float32)" in fails(*command, *more)


def test_predictions_are_one_row_a_test_sample(stores, make_session, tmp_path, run, evaluate):
    """Several sessions are repetitions."""
    speeds = (20, 30, 40, 60)
    other = make_session(tmp_path / "other", speeds=speeds, seconds=3.0, video=False, repetition=1)
    run("extract", other, tmp_path / "two.zarr", *ALONE)
    both = evaluate(stores["audio"], tmp_path / "two.zarr")
    assert both["models"]["vib-te"]["nested"]["n_test"] == 2 * 3 * 4 * 4
    predictions = pd.read_parquet(tmp_path / "r" / "predictions.parquet")
    assert len(predictions) == 2 * 3 * 4 * 4
    probabilities = predictions[["p_1", "p_2", "p_3"]].to_numpy()
    np.testing.assert_allclose(probabilities.sum(axis=1), 1, rtol=1e-5)
    best = np.array(["1", "2", "3"])[probabilities.argmax(axis=1)]
    np.testing.assert_array_equal(best, predictions["predicted_texture"])
    names = predictions["recording"].str.extract(r"(\d):(\d)/")
    assert set(names[0]) == {"1", "2"}
    assert (names[1] == predictions["true_texture"]).all()


def test_less_of_the_data_beside_all_of_it(stores, tmp_path, does, fails, evaluate):
    """Ablations are options; runs of them stand in one table, and can be reported."""
    options = ("--protocol", "published", "--held-out", 20)
    evaluate(stores["video"], out="all", models="sa-se", more=options)
    less = ("--textures", "1,3", "--speeds", "20..60:20", "--markers", 0.5, "--train-speeds", 1)
    summary = evaluate(stores["video"], out="less", models="sa-se", more=(*options, *less))
    assert (summary["textures"], summary["chance"]) == (["1", "3"], 0.5)
    n_train, of_all = (
        json.loads(next(tmp_path.glob(f"{out}/folds/sa-se/*/*/20/fold.json")).read_text())[
            "n_train"
        ]
        for out in ("less", "all")
    )
    assert 0 < n_train <= of_all / 2
    does("report", tmp_path / "all", tmp_path / "less", "--quiet")
    assert "--markers 0.5 --train-speeds 1" in (tmp_path / "all" / "runs.md").read_text()
    assert "--train-speeds 1" in (tmp_path / "less" / "report.html").read_text()
    command = ("evaluate", stores["video"], "--out", tmp_path / "all", "--models", "sa-se")
    assert "ablation" in fails(*command, "--preset", "quick", *options, *less)
    assert "found one twice" in fails("report", tmp_path / "all", tmp_path / "all")

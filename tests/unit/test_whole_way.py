"""Raw mp4 and wav in, Table 1 out, through the command line as a user would."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ...conftest import few_epochs

pytestmark = pytest.mark.system

ALONE = ("--quiet", "--workers", 1)


@pytest.fixture
def extracted(stores):
    """The small session's store."""
    return stores["video"]


def test_extract_recovers_the_shift(extracted):
    """Texture 2 at 40 mm/s pulls all discs by 8 px and shakes them by sin(0.8 n) in frame n."""
    responses = xr.open_zarr(extracted, group="2/40", consolidated=False)
    n = np.arange(45)
    shift = 8 * np.clip((n - 10) / 4, 0, 1) + np.where(n > 10, np.sin(0.8 * n), 0.0)
    sa1 = responses["sa1"].values
    assert sa1.shape == (45, 361)
    np.testing.assert_allclose(sa1[10:], np.repeat(shift[10:, None], 361, axis=1), atol=0.35)
    assert np.sqrt(np.nanmean((sa1[10:] - shift[10:, None]) ** 2)) < 0.1
    assert np.isnan(sa1[:10]).all()
    assert responses["ra2"].shape == (4000, 1)
    np.testing.assert_array_equal(responses["row"].values[:20], [0] * 19 + [1])


def test_all_models_both_protocols_then_a_report(extracted, tmp_path, run):
    results = tmp_path / "results"
    options = ("--window-s", 0.2, "--stride-s", 0.1, "--protocol", "both", *ALONE, "--json")
    with few_epochs():  # none of the frames, whose accuracy is asked for below
        code, out, err = run("evaluate", extracted, "--out", results, *options)
    assert code == 0, err
    summary = json.loads(out)
    assert list(summary["models"]) == [
        "sa-se", "ra-se", "sa-ste", "ra-ste", "vib-te", "vib-te-aug", "sa-wave-vector",
    ]  # fmt: skip
    assert json.loads((results / "summary.json").read_text()) == summary
    for entry in summary["models"].values():
        assert not any(entry["nested"]["leaks"].values())
        assert entry["published"]["leaks"]["test_samples_of_a_speed_seen_in_validation"] > 0
        assert set(entry["nested"]["by_speed"]) == {"20", "40", "60"}
        low, high = entry["nested"]["ci95"]
        assert 0 <= low <= entry["nested"]["mean_accuracy"] <= high <= 1
    # Frames 16 to 44 of 9 recordings: nested tests them all, published the odd ones.
    assert summary["models"]["sa-se"]["nested"]["n_test"] == 9 * 29
    assert summary["models"]["sa-se"]["published"]["n_test"] == 9 * 14
    # How far the discs are pulled tells these textures apart at any speed.
    assert summary["models"]["sa-se"]["nested"]["mean_accuracy"] > 0.8

    code, out, err = run("report", results, "--quiet")
    assert code == 0, err
    page = (results / "report.html").read_text()
    for figure in (8, 9, 10, 11, 12, 13):
        assert f"Figure {figure}" in page
    assert not re.search(r"(src|href)=\"https?:", page)
    assert "no reproduction" in page


def test_finished_folds_are_not_trained_again(stores, tmp_path, run):
    store, results = stores["audio"], tmp_path / "r"
    command = ("evaluate", store, "--out", results, "--models", "vib-te", *ALONE, "--json")
    first = json.loads(run(*command)[1])
    kept = results / "folds/vib-te/nested/seed-0/20/weights.safetensors"
    lost = results / "folds/vib-te/nested/seed-0/40"
    before = kept.stat().st_mtime_ns
    shutil.rmtree(lost)
    again = json.loads(run(*command)[1])
    assert kept.stat().st_mtime_ns == before
    assert lost.is_dir()
    for summary in (first, again):
        summary["models"]["vib-te"]["nested"].pop("seconds")
    assert again == first


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_the_precision_asked_for_is_the_one_of_the_folds(stores, precision, tmp_path, run):
    store, results = stores["audio"], tmp_path / "r"
    asked = ("--models", "vib-te", "--held-out", 30, "--precision", precision, *ALONE, "--json")
    assert run("evaluate", store, "--out", results, *asked)[0] == 0
    fold = json.loads((results / "folds/vib-te/nested/seed-0/30/fold.json").read_text())
    assert fold["precision"] == precision
    other = {"float32": "bfloat16", "bfloat16": "float32"}[precision]
    code, _, said = run("evaluate", store, "--out", results, *asked, "--precision", other)
    assert code == 2
    assert f"precision {other})" in said


def test_predictions_are_one_row_a_test_sample(stores, tmp_path, run):
    store, results = stores["audio"], tmp_path / "r"
    run("evaluate", store, "--out", results, "--models", "vib-te", *ALONE, "--json")
    predictions = pd.read_parquet(results / "predictions.parquet")
    assert len(predictions) == 3 * 4 * 4
    probabilities = predictions[["p_1", "p_2", "p_3"]].to_numpy()
    np.testing.assert_allclose(probabilities.sum(axis=1), 1, rtol=1e-5)
    best = np.array(["1", "2", "3"])[probabilities.argmax(axis=1)]
    np.testing.assert_array_equal(best, predictions["predicted_texture"])
    assert (predictions["recording"].str.split("/").str[0] == predictions["true_texture"]).all()


def test_several_sessions_are_repetitions(stores, make_session, tmp_path, run):
    speeds = (20, 30, 40, 60)
    other = make_session(tmp_path / "other", speeds=speeds, seconds=3.0, video=False, repetition=1)
    run("extract", other, tmp_path / "two.zarr", *ALONE)
    both = (stores["audio"], tmp_path / "two.zarr")
    code, out, err = run(
        "evaluate", *both, "--out", tmp_path / "r", "--models", "vib-te", *ALONE, "--json"
    )
    assert code == 0, err
    assert json.loads(out)["models"]["vib-te"]["nested"]["n_test"] == 2 * 3 * 4 * 4
    names = pd.read_parquet(tmp_path / "r" / "predictions.parquet")["recording"]
    assert set(names.str.split(":").str[0]) == {"1", "2"}


def test_the_published_tracker_takes_its_order_from_throw_away(
    make_session, add_reference_video, tmp_path, run
):
    root = make_session(tmp_path / "published", textures=(1,), speeds=(20, 40))
    add_reference_video(root / "1" / "20")
    code, _, err = run("extract", root, tmp_path / "p.zarr", "--tracker", "published", *ALONE)
    assert code == 0, err
    responses = xr.open_zarr(tmp_path / "p.zarr", group="1/40", consolidated=False)
    rest = responses["rest_position"].values
    # The published order is by x, and its fixed roll of 6.2 degrees leaves every place taken.
    assert (np.diff(rest[:, 0]) > -1).all()
    places = set(zip(responses["row"].values, responses["column"].values, strict=True))
    assert len(places) == 361


def test_less_of_the_data_beside_all_of_it(extracted, tmp_path, run):
    """Ablations are options; runs of them stand in one table, and can be reported."""
    options = ("--models", "sa-se", "--protocol", "published", "--held-out", 20, *ALONE, "--json")
    assert run("evaluate", extracted, "--out", tmp_path / "all", *options)[0] == 0
    less = ("--textures", "1,3", "--speeds", "20..60:20", "--markers", 0.5, "--train-speeds", 1)
    code, out, err = run("evaluate", extracted, "--out", tmp_path / "less", *options, *less)
    assert code == 0, err
    summary = json.loads(out)
    assert (summary["textures"], summary["chance"]) == (["1", "3"], 0.5)
    fold = json.loads(next(tmp_path.glob("less/folds/sa-se/*/*/20/fold.json")).read_text())
    of_all = json.loads(next(tmp_path.glob("all/folds/sa-se/*/*/20/fold.json")).read_text())
    assert 0 < fold["n_train"] <= of_all["n_train"] / 2
    code, out, err = run("report", tmp_path / "all", tmp_path / "less", "--quiet")
    assert code == 0, err
    assert "--markers 0.5 --train-speeds 1" in (tmp_path / "all" / "runs.md").read_text()
    assert "--train-speeds 1" in (tmp_path / "less" / "report.html").read_text()
    code, _, err = run("evaluate", extracted, "--out", tmp_path / "all", *options, *less)
    assert code == 2
    assert "ablation" in err
    code, _, err = run("report", tmp_path / "all", tmp_path / "all")
    assert code == 2
    assert "folders of different names" in err


def test_some_speeds_alone_are_held_out(stores, tmp_path, run):
    store, results = stores["audio"], tmp_path / "r"
    options = ("evaluate", store, "--out", results, "--models", "vib-te", *ALONE, "--json")
    code, out, err = run(*options, "--held-out", "20,60")
    assert code == 0, err
    assert list(json.loads(out)["models"]["vib-te"]["nested"]["by_speed"]) == ["20", "60"]
    assert json.loads(out)["options"] == ["--held-out", "20,60"]
    fold = results / "folds/vib-te/nested/seed-0/20/fold.json"
    before = fold.stat().st_mtime_ns
    assert len(json.loads(run(*options)[1])["models"]["vib-te"]["nested"]["by_speed"]) == 4
    assert fold.stat().st_mtime_ns == before, "what is finished was trained again"
    code, _, err = run(*options, "--held-out", "25")
    assert code == 2
    assert "--held-out: expected some of 20, 30, 40, 60 mm/s, found 25" in err


def test_status_tells_what_is_done_and_how_to_go_on(stores, tmp_path, run):
    store, results = stores["audio"], tmp_path / "r"
    run("evaluate", store, "--out", results, "--models", "vib-te", *ALONE, "--json")
    code, out, _ = run("status", results)
    assert code == 0
    assert "4 of 4 trainings are done." in out
    shutil.rmtree(results / "folds/vib-te/nested/seed-0/40")
    code, out, _ = run("status", results, "--json")
    assert json.loads(out)["counts"] == {
        "done": 3, "running": 0, "to do": 1, "failed": 0, "stopped": 0,
    }  # fmt: skip
    assert json.loads(out)["seconds_left"] > 0
    assert "goes on where it stopped" in run("status", results)[1]
    code, _, err = run("status", tmp_path)
    assert code == 2
    assert "a results folder that evaluate has begun" in err

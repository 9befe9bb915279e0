"""`explain --shear` and the models of it, on textures that pull the skin as a whole."""

import json
from dataclasses import replace

import numpy as np
import pytest

import afferents
from afferents.evaluation.data import open_data
from afferents.evaluation.schemas import Difference
from afferents.progress import Progress
from afferents.reporting.shear import BOTH, SHEAR, WITHOUT, Recognised, explain_shear_of, meaning


def test_textures_that_pull_the_whole_skin_are_told_by_shear(stores, tmp_path, does):
    out = tmp_path / "shear"
    said = does("explain", stores["video"], "--shear", "--out", out, "--quiet")
    assert "of the variance is global shear" in said
    facts = json.loads((out / "shear.json").read_text())
    between = facts["variances_px2"]["between textures"]
    # Pulls of 4, 8 and 12 px along x, the same for all markers.
    assert between["shift"] == pytest.approx(np.var([4, 8, 12]), rel=0.02)
    assert between["gradients"] + between["local"] < 0.01 * between["shift"]
    assert facts["accuracy"][SHEAR]["mean"] > 0.6  # learnt from four runs of a texture
    assert set(facts["accuracy"][SHEAR]["by_speed"]) == {"20", "40", "60"}
    assert facts["drag_px"]["2"] == pytest.approx([8, 8, 8], rel=0.1)
    assert (out / "shear.png").is_file()
    again = afferents.explain_shear(stores["video"], out, quiet=True)
    assert [table.attrs["title"] for table in again.tables][1] == "Texture at held-out speeds"


def test_markers_that_stand_in_no_image_are_asked_one_by_one(stores, tmp_path):
    (data,) = open_data([str(stores["video"])])
    placeless = tuple(r.drop_vars(["row", "column"]) for r in data.responses[1:])
    quiet = Progress(quiet=True)
    found = explain_shear_of(replace(data, responses=placeless), tmp_path / "shear", "all", quiet)
    assert list(found.facts["accuracy"]) == [SHEAR, WITHOUT, BOTH]
    assert found.facts["drag_px"]["1"][0] is None  # which was not recorded


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        (("explain", "AUDIO", "--shear"), "expected recordings of markers, found none in"),
        (("explain", "model", "VIDEO", "--shear"), "--shear: expected DATA alone, without a model"),
        (("explain", "model"), "DATA: expected a store beside the model, found none"),
        (
            ("evaluate", "VIDEO", "--models", "shear", "--markers", 0.5),
            "found shear, which learns from their moments",
        ),
    ],
)
def test_what_can_not_be_asked(stores, tmp_path, fails, command, sentence):
    places = {"AUDIO": stores["audio"], "VIDEO": stores["video"]}
    given = [places.get(word, word) for word in command]
    assert sentence in fails(*given, "--out", tmp_path / "why", "--quiet")
    assert not (tmp_path / "why").exists()


def test_the_models_of_shear_have_their_folds(stores, tmp_path, does):
    models = "shear,sa-local,sa-wave-local"
    out = does(
        "evaluate", stores["video"], "--out", tmp_path / "r", "--models", models,
        "--frames", 5, "--held-out", 40, "--json", "--workers", 1,
    )  # fmt: skip
    found = {name: of["nested"] for name, of in json.loads(out)["models"].items()}
    assert list(found) == models.split(",")
    assert not any(any(one["leaks"].values()) for one in found.values())
    assert found["shear"]["mean_accuracy"] > 0.9


TOLD = dict.fromkeys((SHEAR, WITHOUT, BOTH), Recognised(0.5, 0.4, 0.6))
MORE = Difference(difference=0.2, ci95=(0.1, 0.3))
SAME = Difference(difference=0.0, ci95=(-0.1, 0.1))


@pytest.mark.parametrize(
    ("accuracies", "without_shear", "shear_alone", "said"),
    [
        (
            dict.fromkeys(TOLD, Recognised(0.1, 0.0, 0.2)),
            SAME,
            SAME,
            "these data do not tell from chance",
        ),
        (TOLD, MORE, MORE, "20.0 points are lost without the global shear, 20.0 without the rest"),
        (TOLD, MORE, SAME, "The global shear carries the texture"),
        (TOLD, SAME, MORE, "The images carry the texture without the global shear"),
        (TOLD, SAME, SAME, "show no gain of both"),
    ],
)
def test_the_sentence_follows_from_the_intervals(accuracies, without_shear, shear_alone, said):
    assert said in meaning(accuracies, 0.1, without_shear, shear_alone)

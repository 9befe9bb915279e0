"""Penalties that are chosen inside the fold, and accuracies by length of touch."""

import json

import numpy as np
import pytest

import afferents
from afferents.models.solved import PENALTY, SEARCHED


def facts_of(results, model):
    return json.loads(
        (results.root / "folds" / model / "nested" / "seed-0" / "40" / "fold.json").read_text()
    )


def test_a_penalty_is_chosen_where_that_is_asked_for(stores, tmp_path):
    options = {"frames": 5, "window_s": 0.25, "workers": 1, "quiet": True, "held_out": (40,)}
    models = ["sa-wave", "fusion"]
    usual = afferents.evaluate(stores["video"], tmp_path / "f", models, **options)
    found = afferents.evaluate(
        stores["video"], tmp_path / "s", models, penalty="searched", **options
    )
    assert facts_of(usual, "sa-wave")["penalty"] == PENALTY
    assert facts_of(found, "sa-wave")["penalty"] in SEARCHED
    assert {part["penalty"] for part in facts_of(found, "fusion")["parts"].values()} <= {*SEARCHED}
    assert "penalty" not in usual.config
    assert found.config["penalty"] == found.summary["penalty"] == "searched"
    assert "--penalty searched" in " ".join(found.summary["options"])
    table = found.accuracy_by_touch
    assert list(table["model"]) == ["sa-wave"] * 3 + ["fusion"] * 3
    assert list(table["touch_s"]) == [0.11, 1.0, 4.0] * 2
    told = table[~np.isnan(table["accuracy"])]
    assert len(told)
    assert ((told["ci95_low"] <= told["accuracy"]) & (told["accuracy"] <= told["ci95_high"])).all()
    assert (abs(told["seconds"] - told["touch_s"]) <= 0.25 * told["touch_s"]).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--models", "sa-se"), "--penalty: expected models that it is for (ridge-te, order-te"),
        (("--models", "sa-wave", "--split", "texture"), "--penalty: expected none with --split"),
    ],
)
def test_no_penalty_is_chosen_where_there_is_none(options, said, stores, tmp_path, fails):
    asked = ("--out", tmp_path / "r", "--penalty", "searched")
    assert said in fails("evaluate", stores["video"], *asked, *options)

"""Penalties that are chosen inside the fold, and accuracies by length of touch."""

import json

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
    assert found.summary["options"]["penalty"] == "searched"
    by_touch = [found.found.models[model]["nested"].by_touch for model in models]
    assert [list(one) for one in by_touch] == [["0.11", "1", "4"]] * 2
    told = [(float(touch), one) for its in by_touch for touch, one in its.items() if one]
    assert told
    for touch_s, one in told:
        assert one.ci95[0] <= one.mean_accuracy <= one.ci95[1]
        assert abs(one.seconds - touch_s) <= 0.25 * touch_s

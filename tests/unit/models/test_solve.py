"""Our own models through the whole of `evaluate`: penalties, paired samples, what is refused."""

import json

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents import Model
from afferents.encodings.samples import make_samples
from afferents.errors import InputError
from afferents.models.fusion import mean_within
from afferents.models.solved import PENALTY, SEARCHED

WAVES = "sa-wave,sa-wave-vector,ra-wave,ra-wave-vector"


@pytest.fixture
def stored(stores):
    return stores["video"]


@pytest.fixture
def heard(stores):
    return stores["audio"]


def test_every_model_of_our_own_has_its_folds(stored, tmp_path, does):
    models = f"ridge-te,order-te,order-te-speed-known,{WAVES},fusion,fusion-speed-known"
    out = does(
        "evaluate", stored, "--out", tmp_path / "r", "--models", models, "--protocol", "both",
        "--window-s", 0.25, "--stride-s", 0.1, "--frames", 5, "--mask", "50Hz", "--json",
        "--workers", 1,
    )  # fmt: skip
    summary = json.loads(out)
    assert sorted(summary["models"]) == sorted(models.split(","))
    for model, of_protocol in summary["models"].items():
        nested = of_protocol["nested"]
        assert not any(nested["leaks"].values()), model
        assert nested["n_test"] > 0
        halved = of_protocol["published"]["leaks"]  # of what is solved at once nothing is picked
        assert halved["test_samples_of_a_speed_seen_in_validation"] == 0, model
        assert nested["recordings"]["inside"]["by"].keys() == {"40"}
    table = pd.read_parquet(tmp_path / "r" / "predictions.parquet")
    felt = table[table["model"] == "fusion"]["predicted_speed_mm_s"]
    assert (felt > 0).all()
    assert table[table["model"] == "sa-wave"]["predicted_speed_mm_s"].isna().all()
    assert table[table["model"] == "order-te-speed-known"]["predicted_speed_mm_s"].isna().all()
    fold = tmp_path / "r" / "folds" / "fusion" / "nested" / "seed-0" / "40" / "fold.json"
    parts = json.loads(fold.read_text())["parts"]
    assert parts.keys() == {"order-te", "sa-wave-vector"}
    assert all(part["weight"] > 0 for part in parts.values())


@pytest.mark.parametrize(
    ("model", "kind", "options", "sentences"),
    [
        *(
            (model, "video", ("--mask", "50Hz,0.0573/mm"), (
                "--mask: expected lines in Hz alone, or models that are told the speed",
                f"found lines in /mm for {model}, which would be told by where they lie",
            ))
            for model in ("ridge-te", "order-te", "fusion")
        ),
        ("sa-se,sa-wave", "video", ("--markers", 0.5, "--frames", 5), (
            "--markers: expected models of tactile images or of vibration, found sa-wave",
        )),
        ("sa-se", "video", ("--penalty", "searched"), (
            "--penalty: expected models that it is for (ridge-te, order-te",
        )),
        ("ra-wave-vector", "video", ("--frames", 5, "--disturb", "sound=0.1"), (
            "--disturb sound=0.1: expected models that it is for",
        )),
        ("ra-wave-vector", "video", ("--frames", 5, "--disturb-training", "sound=1"), (
            "--disturb-training sound=1: expected models",
        )),
        ("fusion", "audio", (), (
            "some that these data support (vib-te, vib-te-aug, ridge-te, order-te",
            "lacks ra2 and sa1_vector in the form it needs",
        )),
        ("order-te-measured", "audio", ("--window-s", 1), (
            "1/20 lacks several vibration channels to measure the speed between",
        )),
    ],
)  # fmt: skip
def test_what_would_tell_a_model_the_speed_or_does_not_fit_the_data_is_refused(
    model, kind, options, sentences, stores, tmp_path, fails
):
    said = fails("evaluate", stores[kind], "--out", tmp_path / "r", "--models", model, *options)
    assert all(sentence in said for sentence in sentences), said
    assert not (tmp_path / "r").exists(), "nothing was trained before"
    if "--mask" in options:  # nor is it kept
        fails("train", stores[kind], tmp_path / "m", "--model", model, *options)


def test_tones_that_follow_the_speed_are_named_when_it_is_told(heard, tmp_path, does):
    out = does(
        "evaluate", heard, "--out", tmp_path / "r", "--models", "order-te-speed-known",
        "--window-s", 1, "--stride-s", 0.5, "--mask", "0.7/mm", "--json", "--workers", 1,
    )  # fmt: skip
    assert json.loads(out)["models"]["order-te-speed-known"]["nested"]["mean_accuracy"] > 0.95


@pytest.mark.parametrize(
    ("classifier", "parts", "found"),
    [
        ("late-fusion", ("order-te", "vib-te"), r"solved at once \(ridge-te, .*\), found vib-te"),
        ("late-fusion", ("mine",), "found mine"),
        ("late-fusion", (), "found 0 parts with late-fusion"),
        ("ridge", ("order-te", "sa-wave"), "found 2 parts with ridge"),
    ],
)
def test_what_can_t_be_joined_is_refused_at_once(stored, tmp_path, classifier, parts, found):
    model = Model("both", channel="ra2", encoding="orders", classifier=classifier, parts=parts)
    with pytest.raises(InputError, match=f"model 'both': expected .*{found}"):
        afferents.evaluate(stored, tmp_path / "r", model, quiet=True)
    assert not (tmp_path / "r").exists()


def samples(recording, stops, length):
    stops = np.asarray(stops, dtype=float)
    attrs = {"name": recording, "texture": "t", "speed_mm_s": 10.0}
    return make_samples(
        np.zeros((len(stops), 1), np.float32), ("feature",), stops - length, stops, attrs
    )


def test_a_window_takes_the_mean_of_what_ends_within_it():
    lead = samples("r", [1.0, 2.0, 9.0], 1.0)
    other = samples("r", [0.5, 1.0, 1.5, 2.5], 0.1)
    values = np.array([[1.0], [2.0], [4.0], [8.0]])
    found = mean_within(lead, np.arange(3), other, np.arange(4), values)
    np.testing.assert_allclose(found[:, 0], [1.5, 4.0, 0.0])
    elsewhere = samples("s", [0.5], 0.1)
    assert mean_within(lead, np.array([0]), elsewhere, np.array([0]), values[:1])[0, 0] == 0


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

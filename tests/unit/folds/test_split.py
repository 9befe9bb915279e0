"""What is held out is a choice: trials of recordings whose speed nobody knows."""

import json
import math
import shutil

import numpy as np
import pandas as pd
import pytest
import soundfile
from safetensors.numpy import load_file
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import LeaveOneGroupOut, cross_val_score

import afferents
from afferents.errors import AfferentsError, InputError
from afferents.folds.held_out import split_named
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneGroupOut as Folds, find_leaks, refuse_leaks
from afferents.models.card import parse_card

from .conftest import SoundFiles

RATE_HZ = 8000
TRIAL = {"models": "ridge-te", "split": "trial", "workers": 1, "quiet": True}


class Stretches(SoundFiles):
    """Sounds ``{texture}_{trial}.wav`` of no known speed; who made them is a condition of some."""

    name, title = "stretches", "stretches"
    encodings = {  # noqa: RUF012
        "spectral": {"window_s": 0.25, "stride_s": 0.25},
        "orders": {"window_s": 0.5, "stride_s": 0.125, "lowest_hz": 3.0},
    }

    def told(self, trial):
        return math.nan, {"trial": int(trial)} | ({"by": "Ann"} if trial != "3" else {})


class AtSpeeds(Stretches):
    """The same, whose trials were at one speed each."""

    name = "stretches at speeds"

    def told(self, trial):
        return 10.0 * int(trial), super().told(trial)[1]


@pytest.fixture(scope="module")
def folder(sounds, tmp_path_factory):
    """Three stretches of time of one recording a texture, of 1 s, 0.8 s in the last of a."""
    root = tmp_path_factory.mktemp("stretches")
    for texture, name in (("1", "a"), ("2", "b"), ("3", "c")):
        sound, rate = soundfile.read(sounds / texture / "60" / "audio.wav")
        for trial in (1, 2, 3):
            long = 0.8 if (name, trial) == ("a", 3) else 1.0
            first = round((trial - 1) * rate)
            stretch = sound[first : first + round(long * rate), 1]
            soundfile.write(root / f"{name}_{trial}.wav", stretch, rate)
    return root


@pytest.fixture(scope="module")
def evaluated(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("split") / "trials"
    protocols = {"protocol": "both", "models": "ridge-te"}
    return afferents.evaluate(Stretches(folder), out, **TRIAL | protocols)


def test_each_trial_is_held_out_in_turn_and_nothing_of_it_is_seen(evaluated):
    nested = evaluated.summary["models"]["ridge-te"]["nested"]
    assert (evaluated.summary["split"], evaluated.summary["groups"]) == ("trial", ["1", "2", "3"])
    assert "speeds_mm_s" not in evaluated.summary
    assert set(nested["by"]) == {"1", "2", "3"} == set(nested["validations"])
    assert nested["mean_accuracy"] == pytest.approx(np.mean(list(nested["by"].values())))
    assert nested["mean_accuracy"] > 0.9  # the textures sound apart
    assert nested["inside"] is None
    assert not any(nested["leaks"].values())
    assert set(nested["leaks"]) >= {
        "test_samples_of_a_group_seen_in_training", "scale_saw_held_out_group",
    }  # fmt: skip
    published = evaluated.summary["models"]["ridge-te"]["published"]
    # Nothing of what is solved at once is picked by the other half.
    assert published["leaks"]["test_samples_of_a_group_seen_in_validation"] == 0
    rows = evaluated.predictions
    assert (rows["recording"].str[-1] == rows["held_out_group"]).all()
    assert "held_out_speed_mm_s" not in rows
    table = evaluated.accuracy
    assert list(table["held_out_group"].dropna().unique()) == ["1", "2", "3"]
    facts = json.loads(next(evaluated.root.glob("folds/*/nested/*/2/fold.json")).read_text())
    assert (facts["split"], facts["held_out"]) == ("trial", "2")
    assert facts["validated_by"] in "13"


def test_the_held_out_trial_changes_nothing_of_what_is_learnt(evaluated, folder, tmp_path):
    """Other sound in trial 2 leaves the model that is tested on it as it was."""
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    rng = np.random.default_rng(0)
    for path in other.glob("*_2.wav"):
        soundfile.write(path, rng.normal(0, 0.1, RATE_HZ), RATE_HZ)
    again = afferents.evaluate(Stretches(other), tmp_path / "r", held_out=[2], **TRIAL)
    weights = [
        load_file(next(r.root.glob("folds/ridge-te/nested/*/2/weights.safetensors")))
        for r in (evaluated, again)
    ]
    assert weights[0]
    for name, value in weights[0].items():
        np.testing.assert_allclose(weights[1][name], value, rtol=1e-6)
    assert list(again.summary["models"]["ridge-te"]["nested"]["by"]) == ["2"]


def test_the_report_status_and_pictures_speak_of_trials(evaluated, does):
    page = afferents.report(evaluated.root, quiet=True).read_text()
    assert "leave-one-trial-out evaluation" in page
    assert "--split trial" in page
    assert "speeds held out" not in page
    assert (evaluated.root / "figures" / "accuracy-by-group.png").is_file()
    assert "Worst trial here" in (evaluated.root / "table1.md").read_text()
    jobs = json.loads(does("status", evaluated.root, "--json"))["jobs"]
    assert {job["held_out"] for job in jobs} == {"1", "2", "3"}
    assert afferents.plot.accuracy_by_speed(evaluated).get_xlabel() == "held-out trial"
    one = afferents.plot.confusion(evaluated, protocol="nested", held_out="2")
    assert "trial 2 held out" in one.get_title()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"split": "speed"}, "the speed of every recording, found none of a_1"),
        ({"split": "texture"}, "--split: expected 'speed', .*found 'texture'"),
        ({"held_out": ["4"]}, "--held-out: expected some of 1, 2, 3, found 4"),
        ({"without": {"trial": "3"}}, "at least 3 values of trial, to hold one out under nested"),
        ({"models": "order-te"}, "order-te, for which a_1 lacks a speed"),
        ({"models": "fusion"}, "fusion, for which a_1 lacks"),
        ({"mask": "0.5/mm"}, "found lines in /mm for ridge-te, which would be told"),
        ({"steady": (0.1, 2.0)}, "whose ra2 is from 0.00 to 1.00 s, found 0.1:2"),
        ({"speeds": "10"}, "--speeds: expected recordings whose speed is known, found 10"),
    ],
)
def test_what_can_not_be_is_said_before_anything_is_trained(folder, tmp_path, options, said):
    with pytest.raises(InputError, match=said):
        afferents.evaluate(Stretches(folder), tmp_path / "r", **TRIAL | options)
    assert not (tmp_path / "r").exists()


def test_fewer_training_speeds_need_speeds(folder, tmp_path):
    with pytest.raises(AfferentsError, match="--train-speeds: expected the speed of every record"):
        afferents.evaluate(Stretches(folder), tmp_path / "r", train_speeds=1, **TRIAL)


def test_a_texture_of_one_trial_alone_is_refused(folder, tmp_path):
    some = tmp_path / "some"
    shutil.copytree(folder, some)
    for trial in (1, 3):
        (some / f"c_{trial}.wav").unlink()
    with pytest.raises(InputError, match="found c in trial 2 alone; record it again"):
        afferents.evaluate(Stretches(some), tmp_path / "r", **TRIAL)


def test_two_repetitions_at_one_speed_are_two_groups(samples_of_repetitions):
    split = split_named("repetition")
    for protocol in PROTOCOLS.values():
        for fold in Folds(protocol, what=split).folds(samples_of_repetitions):
            leaks = find_leaks(samples_of_repetitions, fold, fold.train)
            of = samples_of_repetitions["recording"].values
            assert not {*of[fold.test]} & {*of[fold.train]}
            if protocol.name == "nested":
                refuse_leaks(leaks, fold)
                assert {*samples_of_repetitions["speed_mm_s"].values[fold.test]} == {20.0}


@pytest.fixture
def samples_of_repetitions(folder):
    """Samples of `folder`, all at one speed, whose trials are called repetitions."""
    found = afferents.samples(Stretches(folder), "ra2", "spectral", split="trial", quiet=True)
    n = found.sizes["sample"]
    return found.assign_coords(speed_mm_s=("sample", np.full(n, 20.0)))


def test_samples_carry_groups_for_cross_validation(folder):
    by_trial = afferents.samples(Stretches(folder), "ra2", "spectral", split="trial", quiet=True)
    flat = by_trial.values.reshape(len(by_trial), -1)
    scores = cross_val_score(
        LogisticRegression(), flat / flat.max(), by_trial.texture, groups=by_trial.group,
        cv=LeaveOneGroupOut(),
    )  # fmt: skip
    assert len(scores) == 3
    ours = [fold.held_out for fold in Folds(what=split_named("trial")).folds(by_trial)]
    assert ours == ["1", "2", "3"]
    by_speed = afferents.samples(AtSpeeds(folder), "ra2", "spectral", quiet=True)
    np.testing.assert_array_equal(by_speed.group, by_speed.speed_mm_s)


def test_a_steady_part_is_taken_without_extracting_again(stores, run, tmp_path):
    command = ("--models", "ridge-te", "--window-s", 0.5, "--workers", 1, "--quiet", "--json")
    out = tmp_path / "r"
    code, printed, err = run("evaluate", stores["audio"], "--out", out, *command,
                             "--held-out", 30, "--steady", "0.5:2")  # fmt: skip
    assert code == 0, err
    summary = json.loads(printed)
    assert (summary["steady_s"], summary["options"]) == (
        [0.5, 2.0], {"steady": "0.5:2", "held_out": [30], "window_s": 0.5},
    )  # fmt: skip
    assert json.loads((out / "config.json").read_text())["steady_s"] == [0.5, 2.0]
    rows = pd.read_parquet(out / "predictions.parquet")
    assert rows["start_s"].min() == 0.5
    assert rows["stop_s"].max() <= 2.001
    assert rows["held_out_speed_mm_s"].unique().tolist() == [30.0]
    page = afferents.report(out, quiet=True).read_text()
    assert "<dt>Steady part</dt><dd>0.5:2\u00a0s" in page


def test_a_model_learns_from_all_trials_but_one_and_its_card_says_so(folder, tmp_path):
    data, out = Stretches(folder), tmp_path / "m"
    asked = {"model": "vib-te", "preset": "quick", "quiet": True}
    card = afferents.train(data, out, split="trial", steady=(0.0, 0.75), **asked)
    assert (card.split, card.learnt_from, card.validated_on) == ("trial", ("1", "3"), "2")
    said = " ".join(card.describe())
    assert "Of 9 recordings it learnt from those with trial 1, 3 (preset quick)" in said
    assert "Of each recording 0 to 0.75 s were taken, as --steady says." in said
    content = json.loads((out / "model.json").read_text())
    assert "learnt_from_mm_s" not in content
    assert parse_card(json.dumps(content), "a card") == card
    explained = afferents.explain(out, data, tmp_path / "why", quiet=True)
    assert "samples with trial 2, not learnt from" in explained.sentences[0]
    with pytest.raises(InputError, match="the speed of every recording"):
        afferents.train(data, tmp_path / "other", **asked)

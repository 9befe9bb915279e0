"""A model's card says what it is, its probabilities are calibrated, and the file says the same."""

import io
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from rich.console import Console
from scipy.special import softmax
from scipy.stats import beta

import afferents
from afferents.errors import InputError
from afferents.evaluation.data import find_sources, open_data
from afferents.evaluation.train import describe_sensor
from afferents.lab.live import Network
from afferents.lab.live.network import Outcome
from afferents.lab.live.prediction import Counters
from afferents.lab.live.quality import AudioQuality
from afferents.lab.live.reporters import ModelReporter, limit_confidence
from afferents.lab.live.terminal import Screen
from afferents.models.calibrate import (
    best_evidence,
    fit_temperature,
    most_that_can_show,
    soften,
    wilson_interval,
)
from afferents.models.card import read_card
from afferents.models.evidence import MEMORY_S, EvidenceAccumulator
from afferents.models.model import MODELS


def test_the_card_says_what_it_learnt_from(models):
    card = Network(models["ra-ste"]).card
    assert (card.learnt_from_mm_s, card.validated_on_mm_s) == ((20, 60), 40)
    assert (card.fps_hz, card.sample_rate_hz, card.simulated) == (90, None, True)
    assert (card.textures, card.sensor["name"]) == (("1", "2", "3"), "tip_b")
    assert card.describe()[-1] == "Not evaluated at speeds held out."
    sound = Network(models["vib-te-aug"]).card
    assert (sound.sample_rate_hz, sound.shape, sound.sensor) == (8000, (1, 200), None)
    folder = models["ra-ste"].with_suffix("")
    assert read_card(folder / "model.json") == card


def test_the_card_says_how_recordings_were_extracted_where_live_must_know(stores, monkeypatch):
    (opened,) = open_data([str(stores["video"])])
    said = {**opened.origin.data_set.config(), "method": "published", "rest": "reference"}
    monkeypatch.setattr(type(opened.origin.data_set), "config", lambda _: said)
    late = [one.assign_attrs(rest_frame=2) for one in opened.responses]
    source = find_sources(MODELS["sa-se"], opened.encodings)[0]
    felt = describe_sensor(replace(opened, responses=late), source)
    assert felt["sensor"]["rest_frame"] == 2
    assert felt["unlike_live"] == ("--rest reference", "--tracker published")
    felt = describe_sensor(replace(opened, responses=[*late, *opened.responses]), source)
    assert felt["unlike_live"][-1] == "several rest frames"


@pytest.mark.parametrize(("channel", "n", "n_said"), [(0, 2, 1), (1, 2, 0), (0, None, 1)])
def test_the_card_says_which_channel_was_heard_where_it_is_not_the_last(
    stores, monkeypatch, channel, n, n_said
):
    (opened,) = open_data([str(stores["audio"])])
    declared = {"sensor_channel": channel, "audio_channels": n}
    monkeypatch.setattr(type(opened.origin.data_set), "config", lambda _: {"declared": declared})
    felt = describe_sensor(opened, find_sources(MODELS["vib-te"], opened.encodings)[0])
    assert len(felt["unlike_live"]) == n_said


def test_from_python_a_model_says_what_its_file_says(models, stores):
    path = models["sa-se"]
    model = afferents.load_model(path.with_suffix(""))
    samples = afferents.samples(stores["video"], "sa1", "spatial", quiet=True)[::20]
    felt = model.predict(samples)
    network = Network(path)
    for i in range(len(samples)):
        outcome = network.predict(samples.values[i])
        np.testing.assert_allclose(felt.probability[i], outcome.probabilities, atol=1e-5)
        assert float(felt.novelty[i]) == pytest.approx(outcome.novelty, rel=1e-3)
    assert list(felt.texture.values) == list(model.card.textures)
    assert list(felt.recording.values) == list(samples.recording.values)
    assert not felt.speed_outside.any(), "all is at speeds that it learnt from, or between"
    slower = samples.assign_coords(speed_mm_s=("sample", np.full(len(samples), 1.0)))
    assert model.predict(slower).speed_outside.all()
    unknown = samples.assign_coords(speed_mm_s=("sample", np.full(len(samples), np.nan)))
    assert not model.predict(unknown).speed_outside.any()
    with pytest.raises(InputError, match=r"samples: expected \(sample, ...\) of the form"):
        model.predict(samples[:, :5])
    changes = afferents.samples(stores["video"], "ra1", "spatial", quiet=True)[:2]
    with pytest.raises(InputError, match="samples: expected some of sa1, found some of ra1"):
        model.predict(changes)


@pytest.mark.parametrize("kind", ["video", "audio"])
def test_the_best_is_trained_where_nothing_is_asked_for(does, stores, tmp_path, kind):
    said = does("train", stores[kind], tmp_path / "m", "--preset", "quick", "--json")
    best = {"video": "sa-wave-vector", "audio": "vib-te-aug"}[kind]
    assert json.loads(said)["model"] == best


def scores_on_the_card(run, store, folder, *part):
    """Evaluate in `folder`, on a part of the data; return the scores of a model trained on all."""
    asked = ("--models", "vib-te", "--workers", 1, "--quiet", *part)
    assert run("evaluate", store, "--out", folder / "results", *asked)[0] == 0
    code, out, _ = run(
        "train", store, folder / "m", "--model", "vib-te", "--preset", "quick",
        "--results", folder / "results", "--json",
    )  # fmt: skip
    assert code == 0
    return json.loads(out)["scores"]


@pytest.mark.parametrize("part", [(), ("--textures", "1,2"), ("--stride-s", 0.25)])
def test_scores_are_those_of_the_results_and_of_another_task_not_called_the_same(
    run, stores, tmp_path, part
):
    (score,) = scores_on_the_card(run, stores["audio"], tmp_path, *part)
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert score["mean_accuracy"] == summary["models"]["vib-te"]["nested"]["mean_accuracy"]
    assert score["same_data"] is (part == ())
    code, out, _ = run("export", tmp_path / "m", tmp_path / "m.onnx")
    told = "at speeds held out (nested, quick)" in out.replace("\n", " ")
    assert (code, told) == (0, part == ())


def test_what_can_not_be_trained(run, stores, make_session, tmp_path):
    def refused(*arguments):
        code, _, said = run("train", *arguments, "--quiet")
        assert code == 2
        return said

    store, out = stores["audio"], tmp_path / "m"
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "notes.txt").touch()
    for asked, sentence in (
        ((store, out, "--model", "all"), "--model: expected 'best' or one model"),
        ((store, out, "--model", "order-te"), "others can be evaluated, not deployed"),
        ((store, out, "--model", "ra-se"), "some that these data support"),
        (
            (stores["video"], out, "--model", "sa-se", "--frames", 5),
            "--frames: expected models that it is for (sa-ste, ra-ste, sa-ste-aug",
        ),
        (
            (store, tmp_path / "taken", "--model", "vib-te"),
            "a name that is free, found a folder that holds something else",
        ),
        ((store, out, "--model", "vib-te", "--results", tmp_path / "taken"), "a results folder"),
    ):
        assert sentence in refused(*asked)
    one = make_session(tmp_path / "one", speeds=(20,), seconds=3.0, video=False)
    assert run("extract", one, tmp_path / "one.zarr", "--quiet", "--workers", 1)[0] == 0
    said = refused(tmp_path / "one.zarr", tmp_path / "m", "--model", "vib-te")
    assert "at least 2 speeds" in said
    middle = make_session(
        tmp_path / "two", textures=(1, 2), speeds=(20, 60), seconds=3.0, video=False
    )
    make_session(middle, textures=(1, 2, 3), speeds=(40,), seconds=3.0, video=False)
    declared = json.loads((middle / "session.json").read_text())
    declared["holes"] = [["3", 20], ["3", 60]]
    (middle / "session.json").write_text(json.dumps(declared))
    assert run("extract", middle, tmp_path / "two.zarr", "--quiet", "--workers", 1)[0] == 0
    said = refused(tmp_path / "two.zarr", tmp_path / "m", "--model", "vib-te")
    assert "every texture at another speed than 40 mm/s, found none of 3" in said
    assert not (tmp_path / "m").exists()
    assert run("export", tmp_path / "taken", tmp_path / "x.onnx")[0] == 2


@settings(max_examples=20, deadline=None)
@given(true=st.floats(0.3, 4), seed=st.integers(0, 99))
def test_the_temperature_is_found(true, seed):
    """Labels drawn from known probabilities, logits too hot or too cold by a known factor."""
    rng = np.random.default_rng(seed)
    logits = rng.normal(size=(8000, 5)) * 2
    powers = np.exp(logits)
    shares = (powers / powers.sum(1, keepdims=True)).cumsum(1)
    labels = (rng.random((8000, 1)) > shares).sum(1).clip(max=4)
    assert fit_temperature(lambda t: true * logits / t, labels) == pytest.approx(true, rel=0.1)


def test_evidence_of_independent_samples_counts_in_full_and_of_copies_not(rng):
    n, every_s = 400, 0.02
    labels = rng.integers(0, 3, 60)
    logits = rng.normal(size=(60, n, 3)) + 0.5 * np.eye(3)[labels][:, None]
    copies = np.repeat(logits[:, ::20], 20, axis=1)
    found = []
    for given_logits in (logits, copies):
        # the logits' own posterior: normal noise of variance 1, means 0.5 apart
        powers = np.exp(0.5 * given_logits)
        shares = (powers / powers.sum(2, keepdims=True)).reshape(-1, 3)
        recording = np.repeat(np.arange(60), n)
        stop_s = np.tile((1 + np.arange(n)) * every_s, 60)
        found.append(best_evidence(shares, np.repeat(labels, n), recording, stop_s)[0])
    assert found[0] == pytest.approx(1 / every_s, rel=0.35)
    assert found[1] < 0.15 * found[0]


@settings(deadline=None)
@given(cut=st.lists(st.integers(1, 30), min_size=1, max_size=10))
def test_evidence_does_not_depend_on_how_often_it_is_looked_at(cut):
    """The same opinion, told in finer or coarser steps of time, adds up to the same."""
    opinion = np.array([0.5, 0.3, 0.2])
    step = 0.01
    fine, coarse = EvidenceAccumulator(3, 2.0), EvidenceAccumulator(3, 2.0)
    for k in range(1, sum(cut) + 1):
        fine.add(k * step, opinion, step)
    at = 0
    for n in cut:
        at += n
        coarse.add(at * step, opinion, n * step)
    np.testing.assert_allclose(fine.probabilities, coarse.probabilities, atol=1e-9)


def test_evidence_fades_and_is_sure_in_time():
    evidence = EvidenceAccumulator(2, 10.0)
    for k in range(1, 11):
        evidence.add(k / 10, np.array([0.9, 0.1]), 0.1)
    assert evidence.sure_after_s == pytest.approx(0.2)
    leading = evidence.probabilities
    evidence.fade(1 + 3 * MEMORY_S)
    assert leading[0] > evidence.probabilities[0] > 0.5
    in_steps = EvidenceAccumulator(2, 10.0)
    for k in range(1, 11):
        in_steps.add(k / 10, np.array([0.9, 0.1]), 0.1)
    for k in range(1, 91):
        in_steps.fade(1 + 3 * MEMORY_S * k / 90)
    np.testing.assert_allclose(in_steps.probabilities, evidence.probabilities)
    for k in range(1, 40):
        evidence.add(20 + k / 10, np.array([0.05, 0.95]), 0.1)
    assert evidence.sure_after_s < 1.5  # of another touch, not since the beginning
    evidence.reset()
    assert evidence.probabilities.tolist() == [0.5, 0.5]
    assert evidence.sure_after_s is None


@given(weights=st.lists(st.floats(0.001, 100), min_size=2, max_size=13), most=st.floats(0.51, 1))
def test_probabilities_are_capped_in_their_order(weights, most):
    given = np.array(weights) / sum(weights)
    capped = limit_confidence(given, most)
    assert capped.max() <= most + 1e-9
    assert capped.sum() == pytest.approx(1)
    order = np.argsort(given)
    assert (np.diff(capped[order]) >= -1e-12).all()


@pytest.mark.parametrize(("most", "sure"), [(0.8, False), (0.97, True)])
def test_a_touch_is_no_surer_however_long_it_lasts(most, sure):
    """Of two textures each sample says 96%; after a second the sum of them says all but 100."""
    card = SimpleNamespace(model="m", textures=("a", "b"), evidence_per_s=10.0, most_sure=most)
    says = Outcome(np.array([0.96, 0.04], np.float32), 0.0)
    network = SimpleNamespace(card=card, predict=lambda _: says)
    reporter = ModelReporter(network, Counters(), AudioQuality(44100))
    predictions = [reporter.report(np.zeros(1, np.float32), 0.1 * n, 0.1, 0.0) for n in range(30)]
    assert max(p.evidence["a"] for p in predictions) == pytest.approx(most)
    assert (predictions[-1].sure_after_s is not None) == sure
    screen = Screen(SimpleNamespace(reporters=[("audio", reporter)]))
    shown = Console(file=io.StringIO(), width=80)
    screen.take(predictions[-1])
    shown.print(screen.draw(shown))
    assert f"{100 * min(most, 0.96):.0f}% now" in shown.file.getvalue()


def test_the_interval_is_wilson_s():
    assert wilson_interval(0.5, 13) == pytest.approx((0.2612, 0.7388), abs=1e-3)  # by hand
    assert wilson_interval(1.0, 13)[1] == pytest.approx(1.0)
    assert wilson_interval(0.0, 13)[1] < 0.25


def test_few_recordings_that_are_all_right_do_not_make_sure():
    """After n of n the share right is 84% for three, by the beta distribution with n + 1 and 1."""
    for n in (3, 13, 130):
        assert most_that_can_show(n) == pytest.approx(beta(n + 1, 1).median())
    apart = 50 * np.eye(4)[np.tile(np.arange(4), 30)]
    temperature = soften(apart, 0.01, most_that_can_show(3))
    assert softmax(apart / temperature, axis=1).max(axis=1).mean() == pytest.approx(0.84, abs=0.02)
    assert soften(apart, 100.0, 0.84) == 100.0  # it is less sure than that by itself


def test_evidence_that_is_sure_and_wrong_is_found_out():
    """Two textures; all samples of a recording say the same, in half of them what is wrong."""
    labels = np.repeat([0, 1, 0, 1], 50)
    says = np.repeat([0, 1, 1, 0], 50)
    probabilities = np.where(np.eye(2)[says] > 0, 0.99, 0.01)
    recording = np.repeat(["a", "b", "c", "d"], 50)
    _, right = best_evidence(probabilities, labels, recording, np.tile(np.arange(50) / 90, 4))
    assert right in (0.5, 1.0)  # 1 where so little evidence is taken that nothing is ever sure
    _, alone = best_evidence(
        np.where(np.eye(2)[labels] > 0, 0.99, 0.01), labels, recording,
        np.tile(np.arange(50) / 90, 4),
    )  # fmt: skip
    assert alone == 1.0

"""Estimates: what is multiplied is right, whatever the rates of the machine."""

from dataclasses import replace

import numpy as np
import pytest

from afferents.encodings.settings import Encodings
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Recipe
from afferents.folds.ablation import Ablation
from afferents.folds.held_out import SPEED
from afferents.folds.protocol import PROTOCOLS
from afferents.markers.sensor import sensors_of
from afferents.models import rate
from afferents.models.config import training_config
from afferents.models.model import MODELS, TABLE1
from afferents.models.rate import Rate
from afferents.recordings.session import read_session
from afferents.reporting.published import published_costs
from afferents.reproduction import measure
from afferents.reproduction.estimate import (
    Estimate,
    Work,
    amount_of,
    authors_gpu_s,
    duration,
    in_words,
    makespan,
    typical,
)
from afferents.reproduction.measure import (
    Clip,
    Trainings,
    amounts_of,
    expected_epochs,
    measure_recording,
)
from afferents.store.recording import Frame

PUBLISHED, NESTED = PROTOCOLS["published"], PROTOCOLS["nested"]
RECIPES = {"sa-se": "spatial-net", "sa-ste": "cnn-lstm", "vib-te-aug": "vibration-net"}


def work(name, fold_s=1.0, n_folds=10, group=1, epochs=1.0, n_train=1.0):
    return Work(TABLE1[name], "published", group, fold_s, n_folds, epochs, n_train, 1.0, 0.0)


def test_each_process_takes_the_next_job():
    assert makespan([3, 1, 1, 1], 2) == 3
    assert makespan([1] * 10, 4) == 3
    assert makespan([], 4) == 0


def test_models_of_other_samples_wait_here_and_not_on_a_cluster():
    estimate = Estimate(100, 0.1, 2, (work("sa-se", 5, 3, 1), work("ra-se", 5, 3, 2)))
    assert estimate.tracking_s(2) == 5
    assert estimate.training_s(4) == 10
    assert estimate.cluster_s(6) == 10
    assert replace(estimate, gpu=True).training_s(4) == 30
    assert replace(estimate, processes=4).total_s == 15
    assert replace(estimate, processes=6, cluster=True).describe()["total_s"] == 10


@pytest.mark.parametrize(
    ("name", "n", "learnt", "validated", "tested"),
    [
        ("sa-se", 650_000, 585_000, 32_500, 32_500),
        ("sa-ste", 65_000, 58_500, 3_250, 3_250),
        ("vib-te-aug", 15_470, 83_538, 773.5, 773.5),
    ],
)
def test_the_papers_folds_come_out(name, n, learnt, validated, tested):
    config = training_config("paper", RECIPES[name])
    amounts = amounts_of(n, 10, PUBLISHED)
    n_copies = 6 if name == "vib-te-aug" else 0
    rated = Rate(1.0, 1.0, stretch_s=float(n_copies), n_copies=n_copies)
    assert rated.learnt(amounts, PUBLISHED, config) == (learnt, validated)
    assert amounts.test == tested
    stretched = n_copies * amounts.train
    whole = 20 * (learnt + validated) + tested + stretched
    assert rated.fold_s(amounts, PUBLISHED, config, 20) == pytest.approx(whole)


def test_thinned_samples_are_counted_once():
    amounts = amounts_of(650_000, 10, NESTED)
    assert amounts == (520_000, 65_000, 65_000)
    fast = training_config("fast", "spatial-net")
    assert Rate(1.0).learnt(amounts, NESTED, fast) == (40_000, 2000)
    # 28,000 spectra with their six copies: 4000 originals.
    spectra = amounts_of(15_470, 10, NESTED)
    learnt, _ = Rate(1.0, n_copies=6).learnt(
        spectra, NESTED, training_config("fast", "vibration-net")
    )
    assert learnt == 28_000


def test_epochs_are_those_of_the_logs_where_training_stops_early():
    paper, fast = (training_config(preset, "spatial-net") for preset in ("paper", "fast"))
    assert expected_epochs(TABLE1["sa-se"], paper) == pytest.approx(25.1)
    assert expected_epochs(TABLE1["sa-se"], fast) == 3


def test_the_authors_gpu_takes_what_their_logs_say():
    amounts = {"se": 585_000, "ste": 58_500, "te": 13_923, "aug": 83_538}
    works = tuple(
        work(name, epochs=cost.epochs, n_train=amounts[name.rpartition("-")[2]])
        for name, cost in published_costs().items()
    )
    assert authors_gpu_s(Estimate(0, 0, 0, works)) == pytest.approx(141_218)
    assert authors_gpu_s(Estimate(0, 0, 0, (replace(works[0], epochs=None),))) is None


def test_a_clip_ends_when_enough_is_measured(monkeypatch):
    class Still:
        def frames(self):
            image = np.zeros((4, 4), np.uint8)
            return (Frame(i / 90, image) for i in range(10**6))

    monkeypatch.setattr(measure, "TRACKED_S", 0.0)
    clip = Clip(Still(), early=7)
    assert len(list(clip.frames())) == 7 + clip.n
    assert clip.n == measure._FEWEST


@pytest.fixture(scope="module")
def measured(small_session):
    session = read_session(small_session)
    return session, measure_recording(
        typical(session.recordings, "all"), sensors_of(session, None), "one-to-one"
    )


def test_every_kind_of_model_is_measured(measured, tmp_path, monkeypatch):
    for name, less in (("MEASURED_S", 0.01), ("_BATCHES", 1), ("_FEW", 1), ("_MORE", 2)):
        monkeypatch.setattr(rate, name, less)
    session, found = measured
    amount = amount_of(session, found.recording, "all", SPEED, (40.0,), Ablation(), None)
    assert amount.groups == (40.0,)
    assert amount.n_groups == 3
    assert amount.used == pytest.approx(9)
    encodings = Encodings().changed(frames=5, window_s=0.1)
    recipe = Recipe(tmp_path, (), (), encodings, EvaluationOptions(preset="quick"))
    names = ("sa-se", "sa-ste", "sa-wave-vector")
    models = [MODELS[name] for name in names]
    works = Trainings(recipe, found, amount).works(models, [NESTED], lambda *_: 2)
    assert [one.model.name for one in works] == list(names)
    assert [one.group for one in works] == [1, 2, 3]
    assert all(np.isfinite(one.fold_s) and one.fold_s > 0 for one in works)
    assert [one.epochs for one in works] == [4, None, None]
    # 0.33 s at 90 frames/s in each of nine recordings, of which a third validates and one is held.
    assert works[0].n_train == pytest.approx(3 * 29, rel=0.05)
    text = "\n".join(in_words(Estimate(90, 0.01, 2, works, processes=2)))
    assert "an estimate" in text
    assert "on a cluster of 20 such processes" in text


def test_nothing_left_is_said():
    assert in_words(Estimate(0, 0.0, 0)) == ["Nothing is left to be tracked or trained."]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.44, "0.4 s"),
        (40, "40 s"),
        (720, "12 min"),
        (12_000, "3 h 20 min"),
        (187_200, "2 days 4 h"),
    ],
)
def test_durations_are_in_words(seconds, text):
    assert duration(seconds) == text

"""Estimates: what is multiplied is right, whatever the rates of the machine."""

from dataclasses import replace

import numpy as np
import pytest

from afferents.encodings.settings import Encodings
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Recipe
from afferents.folds.protocol import PROTOCOLS
from afferents.markers.sensor import sensors_of
from afferents.models.config import training_config
from afferents.models.model import MODELS, TABLE1
from afferents.recordings.session import read_session
from afferents.reproduction import estimate as module
from afferents.reproduction.estimate import Estimate, Work, estimate, expected_epochs
from afferents.reproduction.run_folder import duration

NAMES = ("sa-se", "sa-ste", "sa-wave-vector")


def test_work_is_shared_out_but_on_a_gpu():
    work = Work("sa-se", "nested", 3, 5.0, 4.0, 100.0)
    found = Estimate(2, 100, 0.1, (work,), processes=2)
    assert found.total_s == (10 + 15) / 2
    assert replace(found, gpu=True).total_s == 5 + 15
    assert found.describe()["trainings"][0]["folds"] == 3
    assert "100 frames of 2 recordings, and 3 trainings" in found.sentence()
    assert Estimate(0, 0, 0.0).sentence() == "Nothing is left to be tracked or trained."


def test_epochs_are_those_of_the_logs_where_training_stops_early():
    paper, fast = (training_config(preset, "spatial-net") for preset in ("paper", "fast"))
    assert expected_epochs(TABLE1["sa-se"], paper) == pytest.approx(25.1)
    assert expected_epochs(TABLE1["sa-se"], fast) == 3


@pytest.fixture
def recipe(tmp_path):
    models = [MODELS[name] for name in NAMES]
    encodings = Encodings().changed(frames=5, window_s=0.1)
    return Recipe(tmp_path, (), models, encodings, EvaluationOptions(preset="quick"))


def test_the_first_frames_and_batches_are_timed(small_session, recipe, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", 2)
    session = read_session(small_session)
    found = estimate(
        session, sensors_of(session, None), "one-to-one", tmp_path / "none.zarr", recipe,
        [PROTOCOLS["nested"]], [0, 1], (40.0,),
    )  # fmt: skip
    assert found.recordings == len(session.recordings)
    assert found.frame_s > 0
    assert [work.model for work in found.trainings] == list(NAMES)
    assert [work.folds for work in found.trainings] == [2, 2, 2]
    assert all(np.isfinite(work.fold_s) and work.fold_s > 0 for work in found.trainings)
    assert [work.epochs for work in found.trainings][::2] == [4, None]
    # 0.33 s at 90 frames/s in each of nine recordings, of which a third validates and one is held.
    assert found.trainings[0].samples == pytest.approx(3 * 29, rel=0.05)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.44, "0.4 s"), (40, "40 s"), (720, "12 min"), (12_000, "3 h 20 min")],
)
def test_durations_are_in_words(seconds, text):
    assert duration(seconds) == text

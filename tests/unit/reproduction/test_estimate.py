"""Estimates: what is multiplied is right, whatever the rates of the machine."""

from dataclasses import replace

import pytest

from afferents.models.config import training_config
from afferents.models.model import TABLE1
from afferents.reproduction.estimate import Estimate, Work, expected_epochs


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
    assert expected_epochs(TABLE1["sa-se"], paper, 24_000) == pytest.approx(25.1)
    assert expected_epochs(TABLE1["sa-se"], fast, 24_000) == 2

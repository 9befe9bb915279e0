"""A training that goes wrong says which it was, and why."""

import shutil
from functools import partial

import numpy as np
import pytest
import torch

from afferents.errors import AfferentsError
from afferents.evaluation import job
from afferents.evaluation import run as evaluation
from afferents.evaluation.fold_files import FoldKey
from afferents.models import fitting
from afferents.models.loop import Checkpoint

ASKED = ("--models", "vib-te", "--quiet", "--workers", 1)


def test_samples_that_are_no_numbers(run, stores, tmp_path, monkeypatch):
    learning_set = fitting.learning_set

    def with_a_hole(*arguments):
        learnt = learning_set(*arguments)
        learnt.values[learnt.train[0]] = np.nan
        return learnt

    monkeypatch.setattr(fitting, "learning_set", with_a_hole)
    code, _, said = run("evaluate", stores["audio"], "--out", tmp_path / "results", *ASKED)
    assert code == 2
    assert "vib-te, nested, seed 0, 20 mm/s held out: training: the loss is no longer" in said


def test_far_trainings_write_checkpoints(run, stores, tmp_path, monkeypatch):
    store, waits, kept = stores["audio"], [], job.keep

    def keep(recipe, outcome):
        waits.append(outcome.key.checkpoint(recipe.out).is_file())
        kept(recipe, outcome)
        waits.append(outcome.key.checkpoint(recipe.out).is_file())

    monkeypatch.setattr(job, "Checkpoint", partial(Checkpoint, every_s=0))
    monkeypatch.setattr(job, "keep", keep)
    monkeypatch.setattr(evaluation, "workers_at", lambda _: 1)
    monkeypatch.setattr(evaluation, "on_cluster", lambda ask, jobs, *_: (ask(*job) for job in jobs))
    ended = run("evaluate", store, "--out", tmp_path / "results", *ASKED, "--cluster", "tcp://here")
    assert ended[0] == 0, ended
    assert waits
    assert waits == [True, False] * (len(waits) // 2)


def test_far_trainings_in_a_row_read_the_data_once(run, stores, tmp_path, monkeypatch):
    opened, open_data = [], job.open_data

    def counted(sources, *more, **options):
        opened.append(sources)
        return open_data(sources, *more, **options)

    monkeypatch.setattr(job, "open_data", counted)
    monkeypatch.setattr(evaluation, "workers_at", lambda _: 1)
    monkeypatch.setattr(evaluation, "on_cluster", lambda ask, jobs, *_: (ask(*job) for job in jobs))
    asked = ("--models", "order-te", "--quiet", "--cluster", "tcp://here", "--window-s", "1")
    ended = run("evaluate", stores["audio"], "--out", tmp_path / "results", *asked)
    assert ended[0] == 0, ended
    assert len(list((tmp_path / "results").rglob("fold.json"))) == 4
    assert len(opened) == 1


def test_a_store_that_changed_under_the_run_is_refused(run, stores, tmp_path, monkeypatch):
    store = shutil.copytree(stores["audio"], tmp_path / "store")
    encoded = job.encoded

    def changed(*arguments):
        settings = store / "zarr.json"
        settings.write_text(settings.read_text().replace('"windowed"', '"one-to-one"'))
        return encoded(*arguments)

    monkeypatch.setattr(evaluation, "encoded", changed)
    code, _, said = run("evaluate", store, "--out", tmp_path / "results", *ASKED)
    assert code == 2
    assert "expected the data that the evaluation began with, found changed data; bring" in said
    assert not list((tmp_path / "results").rglob("fold.json"))


@pytest.mark.parametrize("ask", [lambda: torch.empty(10**15), lambda: np.empty(10**16)])
def test_memory_that_is_short(ask):
    """The errors of the real allocators, whatever they are called."""
    key = FoldKey.of("ra-se", "nested", 1, 10.0)
    with (
        pytest.raises(AfferentsError, match=r"ra-se, nested, seed 1, 10 mm/s .* out of memory"),
        job._naming(key),
    ):
        ask()


def test_other_errors_stay_what_they_are():
    with (
        pytest.raises(RuntimeError, match="ours"),
        job._naming(FoldKey.of("ra-se", "nested", 1, 10)),
    ):
        raise RuntimeError("ours")

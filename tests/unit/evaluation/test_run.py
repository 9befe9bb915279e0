"""What a training does when it goes wrong, and what a run says of itself while it is at work."""

import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch
from sklearn.linear_model import LogisticRegression

from afferents import evaluate
from afferents.errors import AfferentsError, InputError
from afferents.evaluation import run as evaluation
from afferents.evaluation.fold_files import FoldKey, mark_running, write_plan
from afferents.files import write_json
from afferents.models import fitting
from afferents.models.learner import Checkpoint
from afferents.models.model import choose_models
from afferents.outputs import writing_alone
from afferents.recordings.session_file import SESSION_FILE
from afferents.reproduction.run_folder import RunFolder, RunState
from afferents.reproduction.status import status

ASKED = ("--models", "vib-te", "--quiet", "--workers", 1)
FIRST = "vib-te, nested, seed 0, 20 mm/s held out"
SHORT, LONG = (
    [FoldKey.of(model, "nested", 1, speed) for speed in (10.0, 20.0)]
    for model in ("vib-te", "ra-se")
)


def test_samples_that_are_no_numbers(fails, stores, tmp_path, monkeypatch):
    learning_set = fitting.learning_set

    def with_a_hole(*arguments):
        learnt = learning_set(*arguments)
        learnt.values[learnt.train[0]] = np.nan
        return learnt

    monkeypatch.setattr(fitting, "learning_set", with_a_hole)
    said = fails("evaluate", stores["audio"], "--out", tmp_path / "results", *ASKED)
    assert f"{FIRST}: training: the loss is no longer" in said


def test_far_trainings_write_checkpoints(run, stores, tmp_path, monkeypatch):
    """Done here, as a cluster's workers would do them."""
    waits, save_fold = [], evaluation.save_fold

    def save(results, facts, *others):
        waits.append(facts.mark(results, "checkpoint").is_file())
        save_fold(results, facts, *others)

    monkeypatch.setattr(evaluation, "Checkpoint", partial(Checkpoint, every_s=0))
    monkeypatch.setattr(evaluation, "save_fold", save)
    monkeypatch.setattr(evaluation.parallel, "workers_at", lambda _: 1)
    monkeypatch.setattr(
        evaluation.parallel, "on_cluster", lambda ask, jobs, *_: (ask(*job) for job in jobs)
    )
    asked = ("--out", tmp_path / "results", *ASKED, "--cluster", "tcp://here")
    ended = run("evaluate", stores["audio"], *asked)
    assert ended[0] == 0, ended
    assert waits == [True] * 4
    assert not list((tmp_path / "results").rglob("*.checkpoint"))


def test_a_store_that_changed_under_the_run_is_refused(fails, stores, tmp_path, monkeypatch):
    store = shutil.copytree(stores["audio"], tmp_path / "store")
    encode_samples = evaluation.encode_samples

    def changed(*arguments):
        settings = store / "zarr.json"
        settings.write_text(settings.read_text().replace('"windowed"', '"one-to-one"'))
        return encode_samples(*arguments)

    monkeypatch.setattr(evaluation, "encode_samples", changed)
    said = fails("evaluate", store, "--out", tmp_path / "results", *ASKED)
    assert "expected the data that the evaluation began with, found changed data; bring" in said
    assert not list((tmp_path / "results").rglob("fold.json"))


@pytest.mark.parametrize("ask", [lambda: torch.empty(10**15), lambda: np.empty(10**16)])
def test_memory_that_is_short(ask):
    """The errors of the real allocators, whatever they are called; others stay what they are."""
    key = FoldKey.of("ra-se", "nested", 1, 10.0)
    said = r"ra-se, nested, seed 1, 10 mm/s .* out of memory"
    with pytest.raises(AfferentsError, match=said), evaluation._naming(key):
        ask()
    with pytest.raises(RuntimeError, match="ours"), evaluation._naming(key):
        raise RuntimeError("ours")


def test_a_status_says_what_it_knows_nothing_of(tmp_path):
    """Neither of models none of which has ended, nor of workers that leave no mark here."""

    def said(**more):
        write_plan(tmp_path, [*SHORT, *LONG], **{"workers": 1, **more})
        return " ".join(status(tmp_path).sentences)

    facts = {"validated_by": 30.0, "validation_accuracy": 0.5, "epochs": 3, "leaks": {}}
    with mark_running(tmp_path, LONG[0]):
        assert "Expected end" not in said()
        for key, taking in ((SHORT[0], True), (LONG[1], False)):
            content = {**key.content(), **facts, "seconds": 9.0}
            write_json(key.folder(tmp_path) / "fold.json", content)
            assert "Expected end" in said()
            assert ("taking ra-se (none ended yet) to be like the others" in said()) == taking
    assert "Nothing is running" in said()
    elsewhere = said(cluster="tcp://there:1")
    assert "Workers at tcp://there:1 that don't see this folder leave no mark" in elsewhere
    assert "Nothing is running" not in elsewhere


def test_a_status_tells_what_runs_before_any_training(tmp_path):
    """A session that is being simulated, or extracted again beside trainings of an earlier run."""

    def said():
        return " ".join(status(tmp_path).sentences)

    run = RunFolder(tmp_path)
    with writing_alone(run.session, "simulate"):
        write_json(run.session / SESSION_FILE, {"simulated": True})
        assert said() == "A session is being simulated; nothing is extracted."
    assert "was in part simulated" in said()
    assert "Nothing is running" in said()
    run.write_state(
        RunState(like="recommended", choices={}, otherwise=(), differs=(), recordings=3)
    )
    run.results.mkdir()
    write_plan(run.results, SHORT, workers=1)
    assert "Nothing is running" in said()
    with writing_alone(run.store, "extract"):
        assert said() == (
            "0 of 3 recordings are extracted, and more are being. 0 of 2 trainings are done."
        )


def test_what_failed_is_named_once(run, stores, tmp_path, monkeypatch):
    learning_set, results = fitting.learning_set, tmp_path / "r"

    def fail_at(speeds):
        def maybe(*arguments):
            if arguments[4].held_out in speeds:
                raise AfferentsError("no luck")
            return learning_set(*arguments)

        monkeypatch.setattr(fitting, "learning_set", maybe)
        return run("evaluate", stores["audio"], "--out", results, *ASKED)

    code, _, error = fail_at({20, 30, 40, 60})
    assert (code, error) == (2, f"afferents: {FIRST}: no luck\n")
    assert f"Failed: {FIRST}: no luck" in status(results).sentences
    assert fail_at({20})[0] == 2
    done = [n for n in (20, 30, 40, 60) if (results / f"folds/vib-te/nested/seed-0/{n}").is_dir()]
    assert done == [30, 40, 60], "what failed comes last, so all else is done"


def test_a_model_that_workers_cannot_find_is_refused(stores, tmp_path, monkeypatch):
    """They are sent JSON: names, and files that they read."""
    mine = replace(choose_models("vib-te")[0], name="mine", classifier=LogisticRegression())
    monkeypatch.setattr(evaluation.parallel, "workers_at", lambda _: 1)
    with pytest.raises(InputError, match=r"as FILE.py:NAME, .* found the object mine; give the"):
        evaluate(stores["audio"], tmp_path / "r", mine, quiet=True, cluster="tcp://here:1")

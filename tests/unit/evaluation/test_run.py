"""What a run says of itself while it is at work, and what it does when it goes wrong."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from sklearn.linear_model import LogisticRegression

from afferents import evaluate
from afferents.errors import AfferentsError, InputError
from afferents.evaluation import fold_files, run as evaluation
from afferents.files import write_json
from afferents.models import fitting
from afferents.models.learner import Checkpoint
from afferents.models.model import choose_models
from afferents.outputs import writing_alone
from afferents.recordings.session_file import SESSION_FILE
from afferents.reproduction.status import RunFolder, RunState, status

ASKED = ("--models", "vib-te", "--quiet", "--workers", 1)
FIRST = "vib-te, nested, seed 0, 20 mm/s held out"
SHORT, LONG = (
    [fold_files.FoldKey.of(model, "nested", 1, speed) for speed in (10.0, 20.0)]
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

    monkeypatch.setattr(evaluation.learner, "Checkpoint", partial(Checkpoint, every_s=0))
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
    key = fold_files.FoldKey.of("ra-se", "nested", 1, 10.0)
    said = r"ra-se, nested, seed 1, 10 mm/s .* out of memory"
    with pytest.raises(AfferentsError, match=said), evaluation._naming(key):
        ask()
    with pytest.raises(RuntimeError, match="ours"), evaluation._naming(key):
        raise RuntimeError("ours")


def test_a_status_says_what_it_knows_nothing_of(tmp_path):
    """Neither of models none of which has ended, nor of workers that leave no mark here."""

    def said(**more):
        fold_files.write_plan(tmp_path, [*SHORT, *LONG], **{"workers": 1, **more})
        return " ".join(status(tmp_path).sentences)

    facts = {"validated_by": 30.0, "validation_accuracy": 0.5, "epochs": 3, "leaks": {}}
    with fold_files.mark_running(tmp_path, LONG[0]):
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
    fold_files.write_plan(run.results, SHORT, workers=1)
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


FACTS = {"validated_by": 20.0, "validation_accuracy": 0.5, "epochs": 3, "leaks": {}}
FOLDER = "folds/vib-te/nested/seed-0"
KEYS = [fold_files.FoldKey.of("vib-te", "nested", 0, speed) for speed in (10.0, 12.5, 20.0, 40.0)]


def finish(results: Path, key: fold_files.FoldKey, seconds: float) -> None:
    took = {"seconds": seconds, "job_seconds": seconds}
    write_json(key.folder(results) / "fold.json", {**key.content(), **FACTS, **took})


def states(results: Path) -> list[str]:
    return [standing.state for standing in fold_files.job_statuses(results)]


def test_jobs_are_to_do_then_running_then_done_or_failed(tmp_path):
    fold_files.write_plan(tmp_path, KEYS, workers=2)
    assert states(tmp_path) == ["to do"] * 4
    with fold_files.mark_running(tmp_path, KEYS[1]):
        assert states(tmp_path) == ["to do", "running", "to do", "to do"]
        finish(tmp_path, KEYS[1], 3.0)
    with pytest.raises(ValueError, match="no luck"), fold_files.mark_running(tmp_path, KEYS[2]):
        raise ValueError("no luck")
    assert states(tmp_path) == ["to do", "done", "failed", "to do"]
    assert fold_files.job_statuses(tmp_path)[2].why == "no luck"
    with fold_files.mark_running(tmp_path, KEYS[2]):
        assert states(tmp_path)[2] == "running"
    assert states(tmp_path)[2] == "to do"


@pytest.mark.system
def test_a_killed_process_leaves_a_stopped_job(tmp_path):
    fold_files.write_plan(tmp_path, KEYS, workers=1)
    code = (
        "import os, sys; from pathlib import Path\n"
        "from afferents.evaluation.fold_files import FoldKey\n"
        "from afferents.evaluation.fold_files import mark_running\n"
        "with mark_running(Path(sys.argv[1]), FoldKey.of('vib-te', 'nested', 0, 10.0)): os.kill("
        "os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert states(tmp_path) == ["stopped", "to do", "to do", "to do"]


def test_a_mark_of_another_machine_is_believed(tmp_path):
    fold_files.write_plan(tmp_path, KEYS, workers=1)
    mark = KEYS[0].folder(tmp_path).with_name("10.running")
    write_json(mark, {"host": "far-away", "pid": os.getpid(), "since": 0.0})
    assert states(tmp_path)[0] == "running"


def test_what_is_left_is_what_others_took(tmp_path):
    fold_files.write_plan(tmp_path, KEYS, workers=2)
    assert fold_files.seconds_left(fold_files.job_statuses(tmp_path), 2) is None
    finish(tmp_path, KEYS[0], 10.0)
    finish(tmp_path, KEYS[1], 20.0)
    assert fold_files.seconds_left(fold_files.job_statuses(tmp_path), 2) == pytest.approx(15.0)


def test_plans_add_up_once_something_is_kept(tmp_path):
    fold_files.write_plan(tmp_path, KEYS[:2], workers=1)
    fold_files.write_plan(tmp_path, KEYS[2:], workers=1)
    assert len(fold_files.job_statuses(tmp_path)) == 2
    write_json(tmp_path / "config.json", {})
    fold_files.write_plan(tmp_path, KEYS, workers=3)
    assert len(fold_files.job_statuses(tmp_path)) == 4
    assert json.loads((tmp_path / "plan.json").read_text())["workers"] == 3


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("plan.json", {"workers": 1, "cluster": None, "jobs": [{"model": "../x"}]}, "jobs.0.model"),
        (f"{FOLDER}/10.running", {"host": "h", "pid": 1 << 40, "since": 0}, "pid: less than"),
        (f"{FOLDER}/10.failed", [], "found JSON that is no object"),
    ],
)
def test_marks_and_plans_that_make_no_sense_are_named(tmp_path, name, content, said):
    with pytest.raises(InputError, match="a results folder that evaluate has begun"):
        fold_files.job_statuses(tmp_path)
    fold_files.write_plan(tmp_path, KEYS, workers=2)
    write_json(tmp_path / name, content)
    with pytest.raises(InputError, match=name) as caught:
        fold_files.job_statuses(tmp_path)
    assert said in str(caught.value)

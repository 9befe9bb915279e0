"""How far a run has come, told from its folder alone."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from afferents.errors import InputError
from afferents.evaluation.fold_files import (
    FoldKey,
    job_statuses,
    mark_running,
    seconds_left,
    write_plan,
)
from afferents.files import write_json

FACTS = {"validated_by": 20.0, "validation_accuracy": 0.5, "epochs": 3, "leaks": {}}
FOLDER = "folds/vib-te/nested/seed-0"
KEYS = [FoldKey.of("vib-te", "nested", 0, speed) for speed in (10.0, 12.5, 20.0, 40.0)]


def finish(results: Path, key: FoldKey, seconds: float) -> None:
    took = {"seconds": seconds, "job_seconds": seconds}
    write_json(key.folder(results) / "fold.json", {**key.content(), **FACTS, **took})


def states(results: Path) -> list[str]:
    return [standing.state for standing in job_statuses(results)]


def test_jobs_are_to_do_then_running_then_done_or_failed(tmp_path):
    write_plan(tmp_path, KEYS, workers=2)
    assert states(tmp_path) == ["to do"] * 4
    with mark_running(tmp_path, KEYS[1]):
        assert states(tmp_path) == ["to do", "running", "to do", "to do"]
        finish(tmp_path, KEYS[1], 3.0)
    with pytest.raises(ValueError, match="no luck"), mark_running(tmp_path, KEYS[2]):
        raise ValueError("no luck")
    assert states(tmp_path) == ["to do", "done", "failed", "to do"]
    assert job_statuses(tmp_path)[2].why == "no luck"
    with mark_running(tmp_path, KEYS[2]):
        assert states(tmp_path)[2] == "running"
    assert states(tmp_path)[2] == "to do"


@pytest.mark.system
def test_a_killed_process_leaves_a_stopped_job(tmp_path):
    write_plan(tmp_path, KEYS, workers=1)
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
    write_plan(tmp_path, KEYS, workers=1)
    mark = KEYS[0].folder(tmp_path).with_name("10.running")
    write_json(mark, {"host": "far-away", "pid": os.getpid(), "since": 0.0})
    assert states(tmp_path)[0] == "running"


def test_what_is_left_is_what_others_took(tmp_path):
    write_plan(tmp_path, KEYS, workers=2)
    assert seconds_left(job_statuses(tmp_path), 2) is None
    finish(tmp_path, KEYS[0], 10.0)
    finish(tmp_path, KEYS[1], 20.0)
    assert seconds_left(job_statuses(tmp_path), 2) == pytest.approx(15.0)


def test_plans_add_up_once_something_is_kept(tmp_path):
    write_plan(tmp_path, KEYS[:2], workers=1)
    write_plan(tmp_path, KEYS[2:], workers=1)
    assert len(job_statuses(tmp_path)) == 2
    write_json(tmp_path / "config.json", {})
    write_plan(tmp_path, KEYS, workers=3)
    assert len(job_statuses(tmp_path)) == 4
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
        job_statuses(tmp_path)
    write_plan(tmp_path, KEYS, workers=2)
    write_json(tmp_path / name, content)
    with pytest.raises(InputError, match=name) as caught:
        job_statuses(tmp_path)
    assert said in str(caught.value)

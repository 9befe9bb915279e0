"""An evaluation that is shot again and again ends with the table of one that never was."""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import psutil
import pytest

pytestmark = pytest.mark.system

KILLS = 20


def command(store, out):
    """Two models, two protocols, four speeds, six seeds: 96 trainings."""
    options = ("--models", "vib-te,vib-te-aug", "--protocol", "both", "--seeds", "6", "--quiet")
    start = (sys.executable, "-m", "afferents", "evaluate", store, "--out", out, "--workers", "2")
    return [*map(str, start), *options]


def workers_of(run):
    """Return the processes that train for a run."""
    return [
        child
        for child in psutil.Process(run.pid).children(recursive=True)
        if "loky" in " ".join(child.cmdline()) and "resource_tracker" not in child.cmdline()[-1]
    ]


def shoot(run, rng):
    """Kill the run or, every other time, one of its workers; return which.

    On a busy machine it is waited for until there are workers.
    """
    until_s = time.monotonic() + 60
    if rng.random() < 0.5:
        while run.poll() is None and time.monotonic() < until_s:
            with contextlib.suppress(psutil.NoSuchProcess):
                if workers := workers_of(run):
                    rng.choice(workers).kill()
                    return "a worker"
            time.sleep(0.1)
    os.kill(run.pid, signal.SIGKILL)
    return "the run"


def table(out):
    """Return the predictions, in an order of their own, and the summary's models."""
    predictions = pd.read_parquet(out / "predictions.parquet")
    by = ["model", "protocol", "seed", "held_out_speed_mm_s", "recording", "start_s"]
    models = json.loads((out / "summary.json").read_text())["models"]
    for protocols in models.values():
        for found in protocols.values():
            del found["seconds"]
    return predictions.sort_values(by, ignore_index=True), models


@pytest.mark.slow
def test_the_table_is_the_same_however_often_it_was_shot(stores, tmp_path):
    store = stores["audio"]
    subprocess.run(command(store, tmp_path / "calm"), check=True)
    rng = random.Random(0)
    shot = []
    finished_before = 0
    run, told = None, ""
    for _ in range(KILLS):
        if run is None:
            said = tmp_path / "said"
            run = subprocess.Popen(command(store, tmp_path / "shot"), stderr=said.open("w"))
        time.sleep(rng.uniform(1, 8))
        if run.poll() is not None:
            break
        shot.append(shoot(run, rng))
        if shot[-1] == "the run":
            run.wait(timeout=60)
            run = None
            told += said.read_text()
        finished = sum(1 for _ in Path(tmp_path / "shot").rglob("fold.json"))
        assert finished >= finished_before, "what was finished is lost"
        finished_before = finished
    assert len(shot) == KILLS, f"it was done after {len(shot)} shots"
    assert {"a worker", "the run"} == set(shot)
    if run is not None:  # it lost a worker last, and goes on: nobody else may write there meanwhile
        assert run.wait(timeout=300) == 0
        told += said.read_text()
    assert "a worker process died" in told
    assert "Traceback" not in told
    subprocess.run(command(store, tmp_path / "shot"), check=True)
    (found, models), (expected, expected_models) = (
        table(tmp_path / "shot"),
        table(tmp_path / "calm"),
    )
    pd.testing.assert_frame_equal(found, expected)
    assert models == expected_models
    assert not list((tmp_path / "shot").rglob("*.partial*"))

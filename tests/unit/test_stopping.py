"""Stopped by hand: what is finished is kept, nothing is called failed or skipped."""

import os
import signal
import time

import psutil
import pytest

from afferents.reproduction.run_folder import status


@pytest.fixture
def training(launch, stores, tmp_path):
    """Start a training that takes long, in some processes, and wait until it is at work."""
    store, results = stores["audio"], tmp_path / "r"

    def start(workers):
        command = ["evaluate", store, "--out", results, "--workers", workers, "--quiet"]
        command += ["--models", "vib-te-aug", "--preset", "paper", "--keep-going"]
        running = launch(command, imports=["afferents.evaluation.run"], session=True)
        while len(list(results.rglob("*.running"))) < workers:
            assert running.poll() is None
            time.sleep(0.02)
        return running, results

    return start


@pytest.mark.system
@pytest.mark.parametrize(
    ("number", "workers", "to_all"),
    [
        (signal.SIGINT, 1, False),
        (signal.SIGTERM, 1, False),
        (signal.SIGINT, 2, True),  # as a terminal does
        (signal.SIGHUP, 2, True),
        (signal.SIGTERM, 2, False),
    ],
)
def test_a_signal_stops_a_training_and_is_no_failure_of_it(training, number, workers, to_all):
    running, results = training(workers)
    children = psutil.Process(running.pid).children(recursive=True)
    (os.killpg if to_all else os.kill)(running.pid, number)
    _, said = running.communicate()
    assert said == "afferents: stopped; what is finished is kept\n"
    assert running.returncode == 128 + number
    psutil.wait_procs(children, timeout=60)
    assert not [child for child in children if child.is_running()]
    assert not list(results.rglob("*.failed"))
    assert status(results).facts["counts"]["failed"] == 0
    if workers == 1:  # of others the mark says that its process is gone
        assert not list(results.rglob("*.running"))


def test_memory_that_is_short_is_one_sentence_of_any_command(run, monkeypatch, tmp_path):
    def short(*_):
        raise MemoryError

    monkeypatch.setattr("afferents.reproduction.run_folder.status", short)
    code, _, said = run("status", tmp_path)
    assert (code, said.startswith("afferents: out of memory; ")) == (2, True)

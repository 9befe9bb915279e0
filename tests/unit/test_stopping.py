"""Stopped by hand: what is finished is kept, nothing is called failed or skipped."""

import os
import signal
import subprocess
import sys
import time

from afferents.pipeline.status import status


def test_ctrl_c_stops_a_training_and_is_no_failure_of_it(run, sounds, tmp_path):
    store, results = tmp_path / "s.zarr", tmp_path / "r"
    assert run("extract", sounds, store, "--quiet")[0] == 0
    command = [sys.executable, "-m", "afferents", "evaluate", store, "--out", results, "--quiet"]
    command += ["--models", "vib-te-aug", "--preset", "paper", "--workers", "1", "--keep-going"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not list(results.rglob("*.running")):
        assert running.poll() is None
        time.sleep(0.02)
    os.kill(running.pid, signal.SIGINT)
    _, said = running.communicate()
    assert (running.returncode, said) == (130, "afferents: stopped; what is finished is kept\n")
    assert not list(results.rglob("*.failed"))
    assert not list(results.rglob("*.running"))
    assert status(results).facts["counts"]["failed"] == 0


def test_memory_that_is_short_is_one_sentence_of_any_command(run, monkeypatch, tmp_path):
    def short(*_):
        raise MemoryError

    monkeypatch.setattr("afferents.pipeline.status.status", short)
    code, _, said = run("status", tmp_path)
    assert (code, said.startswith("afferents: out of memory; ")) == (2, True)

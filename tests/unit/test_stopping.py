"""Signals end a process tidily, once, and only if it heeds them; what is finished is kept."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from afferents.reproduction.status import status

pytestmark = pytest.mark.system

BEGIN = """
import signal, sys, time
from afferents.stopping import stop_on_signals
def say(text): print(text, flush=True)
stop_on_signals()
"""


@pytest.fixture
def process():
    """Start a script; return its process when it has said that it is ready."""
    started = []

    def start(script, **how):
        command = [sys.executable, "-c", f"{BEGIN}\n{script}"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        one = subprocess.Popen(command, text=True, **pipes, **how)
        started.append(one)
        assert one.stdout.readline() == "ready\n"
        return one

    yield start
    for one in started:
        one.kill()


ALL = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
WAIT = "say('ready'); time.sleep(60)"


@ALL
def test_a_signal_ends_it_with_its_own_code(process, number):
    one = process(WAIT)
    one.send_signal(number)
    assert one.communicate(timeout=30) == ("", "")
    assert one.returncode == 128 + number


def test_what_is_ignored_from_the_start_stays_so(process):
    one = process(WAIT, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    one.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        one.wait(0.5)
    one.send_signal(signal.SIGTERM)
    assert one.wait(30) == 143


TIDY = """
try: say('ready'); time.sleep(60)
finally: say('tidying'); time.sleep({}); say('done')
"""


@pytest.mark.parametrize(
    ("tidies_s", "later_s", "code", "said"),
    [(0.3, 0, 129, "done\n"), (60, 1.2, 130, "")],
    ids=["one that is sent twice is one", "who insists ends it at once"],
)
def test_who_insists_ends_it_at_once(process, tidies_s, later_s, code, said):
    one = process(TIDY.format(tidies_s))
    one.send_signal(signal.SIGHUP)
    assert one.stdout.readline() == "tidying\n"
    time.sleep(later_s)
    one.send_signal(signal.SIGINT if later_s else signal.SIGHUP)
    assert one.communicate(timeout=30) == (said, "")
    assert one.returncode == code


LATER = """
from afferents.stopping import stop_later, stopped_by
with stop_later():
    say('ready')
    while stopped_by() is None:
        time.sleep(0.01)
    say('ended by itself')
say('not reached')
"""


@ALL
def test_what_must_not_be_left_at_any_line_ends_by_itself_first(process, number):
    one = process(LATER)
    one.send_signal(number)
    assert one.communicate(timeout=30) == ("ended by itself\n", "")
    assert one.returncode == 128 + number


SWALLOWED = """
from afferents.stopping import stop_later
class Removed:
    def __del__(self):
        say('ready')
        time.sleep(60)
one = Removed()
del one
with stop_later():
    say('not reached')
"""


def test_a_signal_that_was_swallowed_is_not_forgotten(process):
    """Python lets no error out of the removal of an object."""
    one = process(SWALLOWED)
    one.send_signal(signal.SIGTERM)
    out, err = one.communicate(timeout=30)
    assert (out, err) == ("", "")
    assert one.returncode == 143


ENDING = """
import atexit
from afferents.cli import program
atexit.register(lambda: say('tidied'))
atexit.register(lambda: signal.raise_signal(signal.SIGINT))
sys.argv = ['afferents', '--version']
say('ready')
program.main()
"""


def test_a_signal_that_comes_once_all_is_done_changes_nothing(process):
    one = process(ENDING)
    out, err = one.communicate(timeout=60)
    assert (out.splitlines()[-1], err) == ("tidied", "")
    assert one.returncode == 0


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

"""Signals end a process tidily, once, and only if it heeds them."""

import signal
import subprocess
import sys
import time

import pytest

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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_with_its_own_code(process, number):
    one = process("say('ready'); time.sleep(60)")
    one.send_signal(number)
    assert one.communicate(timeout=30) == ("", "")
    assert one.returncode == 128 + number


def test_what_is_ignored_from_the_start_stays_so(process):
    one = process(
        "say('ready'); time.sleep(60)",
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    one.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        one.wait(0.5)
    one.send_signal(signal.SIGTERM)
    assert one.wait(30) == 143


TIDY = """
try: say('ready'); time.sleep(60)
finally: say('tidying'); time.sleep({}); say('done')
"""


def test_a_signal_that_is_sent_twice_is_one(process):
    one = process(TIDY.format(0.3))
    one.send_signal(signal.SIGHUP)
    assert one.stdout.readline() == "tidying\n"
    one.send_signal(signal.SIGHUP)
    assert one.communicate(timeout=30) == ("done\n", "")
    assert one.returncode == 129


def test_who_insists_ends_it_at_once(process):
    one = process(TIDY.format(60))
    one.send_signal(signal.SIGTERM)
    assert one.stdout.readline() == "tidying\n"
    time.sleep(1.2)
    one.send_signal(signal.SIGINT)
    assert one.communicate(timeout=30) == ("", "")
    assert one.returncode == 130


LATER = """
from threading import Event
from afferents.stopping import stop_later
wanted = Event()
with stop_later(wanted.set):
    say('ready')
    wanted.wait(60)
    say('ended by itself')
say('not reached')
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
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
    assert out == ""
    assert "Exception ignored in" in err
    assert one.returncode == 143

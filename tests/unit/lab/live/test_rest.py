"""Rest that is set anew: from frames without motion, by a key or by a line."""

import fcntl
import os
import pty
import subprocess
import sys
import termios

import numpy as np
import pytest

from afferents.lab.live.follower import REST_FRAMES, find_rest

REST = np.arange(20.0).reshape(10, 2)


def test_it_is_the_median_and_stays_of_markers_that_are_not_seen():
    noise = np.random.default_rng(0).normal(0, 0.02, (REST_FRAMES, 10, 2))
    seen = REST + 3 + noise
    seen[:, 4] = np.nan
    seen[:3, 7] = np.nan
    rest, what = find_rest(seen, REST)
    assert what == "rest was set: displacement counts from here"
    np.testing.assert_array_equal(rest[4], REST[4])
    others = np.delete(np.arange(10), 4)
    np.testing.assert_allclose(rest[others], REST[others] + 3, atol=0.05)


@pytest.mark.parametrize(
    ("step", "found"), [(0.5, "markers that move by 2.2 px"), (np.nan, "no markers")]
)
def test_it_is_not_set_where_markers_move_or_are_not_seen(step, found):
    rest, what = find_rest(REST + step * np.arange(REST_FRAMES)[:, None, None] * [1, 0], REST)
    assert rest is None
    assert what.startswith("rest was not set: expected a skin that stands still for 10 frames")
    assert what.endswith(f"found {found}; let go, and set it again")


WATCHES = """
import sys, threading
from afferents.lab.live.control import set_rest_on_request
asked = threading.Semaphore(0)
with set_rest_on_request(asked.release, sys.argv[1] == "lines"):
    print("ready", flush=True)
    for _ in range(2):
        asked.acquire()
        print("set", flush=True)
"""


def test_the_key_sets_it_and_the_terminal_is_given_back_as_it_was():
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    with subprocess.Popen(
        [sys.executable, "-c", WATCHES, "key"], stdin=theirs, stdout=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY),
    ) as running:  # fmt: skip
        assert running.stdout.readline() == "ready\n"
        os.write(ours, b"qz")
        assert running.stdout.readline() == "set\n"
        os.write(ours, b"z")
        assert running.stdout.readline() == "set\n"
    assert running.returncode == 0
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)


def test_a_line_sets_it_and_another_is_called_unknown():
    running = subprocess.run(
        [sys.executable, "-c", WATCHES, "lines"], input="rest\ngo on\nrest\n", text=True,
        capture_output=True, timeout=120, check=True,
    )  # fmt: skip
    assert running.stdout.split() == ["ready", "set", "set"]
    assert running.stderr == "--control: expected a line 'rest', found 'go on'\n"

"""The main way asks for nothing that only Unix has."""

import os
from asyncio import selector_events

import pytest

from ..hiding import runner

pytestmark = pytest.mark.system
MODULES = ("fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty")
NAMES = {
    "os": (
        *("fork", "getpgid", "getuid", "geteuid", "killpg", "mkfifo", "openpty", "pidfd_open"),
        *("setsid", "statvfs"),
        # newer versions of Python have code of their own here that asks for these two
        *(() if hasattr(selector_events, "SC_IOV_MAX") else ("sysconf",)),
        *(() if hasattr(os, "process_cpu_count") else ("sched_getaffinity",)),
    ),
    "signal": ("SIGHUP", "SIGKILL", "SIGUSR1", "pthread_sigmask"),
}
TINY = ("--textures", "0", "--speeds", "50,60", "--seconds", "2")


def test_simulate_extract_channels_and_live(tmp_path):
    """Nor is any process forked. Windows has more that differs, such as locks of files."""
    run = runner(tmp_path, MODULES, NAMES)
    for command in (
        ("simulate", "rig", *TINY, "--workers", "2", "--quiet"),
        ("extract", "rig", "s.zarr", "--workers", "2", "--quiet"),
        ("live", "--video", "rig/0/50/video.mp4", "--speed", "max", "--json"),
        ("-c", "import afferents; print([*afferents.open_responses('s.zarr')[0]])"),
    ):
        ended = run(*command)
        assert ended.returncode == 0, (command, ended.stderr)
    assert {"sa1", "ra1", "ra2"} <= set(eval(ended.stdout))

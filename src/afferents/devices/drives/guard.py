"""A process beside ours that stops the drum when ours is killed or hangs."""

import subprocess
import sys
from contextlib import suppress
from pathlib import Path

PATIENCE_S = 0.5
"""A drum turns on for so long after the last word of this program."""
_PROGRAM = Path(__file__).with_name("guard_process.py")


class Guard:
    """Watches this process, and writes a stop into the open port if need be.

    It covers crashes, ``kill -9`` and a program that hangs; not a computer without power, nor a
    cable that is pulled: only a watchdog in the drive does.

    Parameters
    ----------
    fd
        Of the open port; None where there is none to pass on (Windows): then nothing is watched.
    stop
        What stops the drive, as sent.
    """

    def __init__(self, fd: int | None, stop: bytes) -> None:
        """Start watching."""
        self._process: subprocess.Popen[bytes] | None = None
        if fd is None or sys.platform == "win32":
            return
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", str(_PROGRAM), str(fd), str(PATIENCE_S), stop.hex()],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            pass_fds=(fd,), start_new_session=True, bufsize=0,
        )  # fmt: skip

    def beat(self, turning: bool) -> None:
        """Say that this program lives, and whether the drum turns."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.write(b"1" if turning else b"0")

    def close(self) -> None:
        """End it, if the drum stands."""
        process, self._process = self._process, None
        if process is not None and process.stdin is not None:
            with suppress(OSError):
                process.stdin.close()
            process.wait(5)

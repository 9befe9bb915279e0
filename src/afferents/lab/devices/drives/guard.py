"""A second process that stops the drum when ours is killed or hangs.

This file is also the program of that process, so it imports nothing of ours.
"""

import os
import select
import subprocess
import sys
from contextlib import suppress

PATIENCE_S = 0.5
"""A drum turns on for this time, s, after the last sign of life of this program."""


class Guard:
    """Watches this process, and writes a stop into the open port if need be.

    It covers crashes, ``kill -9`` and a program that hangs; not a computer without power, nor a
    cable that is pulled: only a watchdog in the drive does.

    Parameters
    ----------
    fd
        Of the open port; None where none is open, or is to be passed on (Windows): then nothing is
        watched.
    stop
        What stops the drive, as sent.
    """

    def __init__(self, fd: int | None, stop: bytes) -> None:
        """Start watching."""
        self._process: subprocess.Popen[bytes] | None = None
        if fd is None or sys.platform == "win32":
            return
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", __file__, str(fd), str(PATIENCE_S), stop.hex()],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            pass_fds=(fd,), start_new_session=True, bufsize=0,
        )  # fmt: skip

    def beat(self, turning: bool) -> None:
        """Signal that this program lives, and whether the drum turns."""
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


def watch(fd: int, patience_s: float, stop: bytes) -> None:
    """Follow stdin: ``1`` while the drum turns, ``0`` when it stands; its end ends this process."""
    turning = False
    while True:
        there, _, _ = select.select([0], [], [], patience_s if turning else None)
        received = os.read(0, 4096) if there else b""
        if turning and not received:
            for _ in range(3):
                with suppress(OSError):
                    os.write(fd, stop)
                select.select([], [], [], 0.05)
        if there and not received:
            return
        turning = received.endswith(b"1") if there else False


if __name__ == "__main__":
    watch(int(sys.argv[1]), float(sys.argv[2]), bytes.fromhex(sys.argv[3]))

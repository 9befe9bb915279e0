"""Stopping by a signal: Ctrl-C, a closed terminal, or a machine that is wanted back."""

import os
import signal
import time
from types import FrameType

from afferents.core.errors import Stopped

PATIENCE_S = 1.0
"""Signals that come so soon after the first one are that one said twice, as terminals do."""

_CURSOR = b"\x1b[?25h"


def stop_on_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP raise `Stopped`, so that all is tidied up.

    What is ignored from the start (by ``nohup``, or in the background of a script) stays so. Who
    signals once more a while later ends the process at once.
    """
    for number in _heeded():
        signal.signal(number, _stop)


def _stop(number: int, frame: FrameType | None) -> None:
    taken_over = signal.getsignal(signal.SIGTERM)
    if callable(taken_over) and taken_over is not _stop:
        taken_over(number, frame)  # by a web server, which lets its visitors go first
        return
    begun = time.monotonic()

    def end(again: int, _: FrameType | None) -> None:
        if time.monotonic() - begun > PATIENCE_S:
            if os.isatty(2):
                os.write(2, _CURSOR)  # which progress bars hide
            os._exit(128 + again)

    for heeded in _heeded():
        signal.signal(heeded, end)
    raise Stopped(number)


def _heeded() -> list[int]:
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) != signal.SIG_IGN]

"""Stopping by a signal: Ctrl-C, a closed terminal, or a machine that is wanted back."""

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from afferents.errors import Stopped

PATIENCE_S = 1.0
"""Signals that come so soon after the first one are that one said twice, as terminals do."""

_CURSOR = b"\x1b[?25h"
_taken: list[int] = []


def stop_on_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP raise `Stopped`, so that all is tidied up.

    What is ignored from the start (by ``nohup``, or in the background of a script) stays so. Who
    signals once more a while later ends the process at once.
    """
    for number in _heeded():
        signal.signal(number, _stop)
    sys.unraisablehook = _report_unraisable


def ignore_signals_briefly() -> None:
    """Let a signal do nothing for `PATIENCE_S`: the work is done, and Python tidies up.

    There Python raises nothing, but prints the traceback of `Stopped`. A later signal ends the
    process at once.
    """
    _end_at_the_next(_heeded())


def _report_unraisable(fault: "sys.UnraisableHookArgs") -> None:
    """Print an error that Python can't raise, unless it is a signal, which `stopped_by` returns."""
    if not isinstance(fault.exc_value, Stopped):
        sys.__unraisablehook__(fault)


def stopped_by() -> int | None:
    """Return the signal that has come, if one has.

    What it raised may have been swallowed: a library that is being imported, or an object that is
    being removed, lets no error of others out, or another in its place.
    """
    return _taken[0] if _taken else None


@contextmanager
def stop_later() -> Iterator[None]:
    """Let a signal raise `Stopped` only when the inside has ended.

    For what must not be left at any line, as an event loop, or the start of other processes.
    Signals reach the main thread alone; in others nothing is done.
    """
    if (number := stopped_by()) is not None:
        raise Stopped(number)
    here = threading.current_thread() is threading.main_thread()
    numbers = [number for number in _heeded() if here and signal.getsignal(number) is _stop]

    def note(number: int, _: FrameType | None) -> None:
        _end_at_the_next(numbers)
        _taken.append(number)

    for number in numbers:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, _stop)
    if (number := stopped_by()) is not None:
        _end_at_the_next(numbers)
        raise Stopped(number)


def _stop(number: int, _: FrameType | None) -> None:
    _taken.append(number)
    _end_at_the_next(_heeded())
    raise Stopped(number)


def _end_at_the_next(numbers: list[int]) -> None:
    """End the process at once when a signal comes again, a while from now."""
    begun = time.monotonic()

    def end(again: int, _: FrameType | None) -> None:
        if time.monotonic() - begun > PATIENCE_S:
            if os.isatty(2):
                os.write(2, _CURSOR)  # which progress bars hide
            os._exit(128 + again)

    for heeded in numbers:
        signal.signal(heeded, end)


def _heeded() -> list[int]:
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) != signal.SIG_IGN]

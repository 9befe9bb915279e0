"""What is asked for while it runs: by a key in the terminal, or by a line on standard input."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

KEY, LINE = "z", "rest"
"""That set rest anew."""


@contextmanager
def set_rest_when_asked(set_rest: Callable[[], object], lines: bool = False) -> Iterator[None]:
    """Call a function whenever somebody asks for it, while the inside runs.

    Parameters
    ----------
    set_rest
        Called from a thread of its own.
    lines
        Whether each line ``rest`` on standard input asks, as a program writes it; else the key
        ``z``, where there is a terminal.
    """
    if lines:
        _listen(_take_lines, set_rest)
        yield
    elif not _is_ours():
        yield
    else:
        import termios
        import tty

        before = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin)  # keys come at once; Ctrl-C stops as ever
        _listen(_take_keys, set_rest)
        try:
            yield
        finally:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _is_ours() -> bool:
    """Tell whether keys come to us: there is a terminal, and we are not in its background."""
    with suppress(OSError, ValueError, AttributeError):
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    return False


def _listen(take: Callable[[Callable[[], object]], None], set_rest: Callable[[], object]) -> None:
    threading.Thread(target=take, args=(set_rest,), name="afferents-control", daemon=True).start()


def _take_keys(set_rest: Callable[[], object]) -> None:
    while key := os.read(sys.stdin.fileno(), 1):
        if key == KEY.encode():
            set_rest()


def _take_lines(set_rest: Callable[[], object]) -> None:
    for line in sys.stdin:
        if line.strip() == LINE:
            set_rest()
        else:
            found = line.strip()
            sys.stderr.write(f"--control: expected a line '{LINE}', found '{found}'\n")

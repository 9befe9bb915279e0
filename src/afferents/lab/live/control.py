"""What is asked for while it runs: by a key in the terminal, or by a line on standard input."""

import os
import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING

from afferents.errors import InputError

if TYPE_CHECKING:
    from afferents.lab.live.lessons import Lessons

KEY, LINE = "z", "rest"
"""That set rest anew."""
_LESSON = re.compile(r"learn(?: +(?P<name>.+?)(?: +at +(?P<speed>[\d.]*\d))?)?")


@contextmanager
def set_rest_when_asked(
    set_rest: Callable[[], object], lines: bool = False, lessons: "Lessons | None" = None
) -> Iterator[None]:
    """Call a function whenever somebody asks for it, while the inside runs.

    Parameters
    ----------
    set_rest
        Called from a thread of its own.
    lines
        Whether each line ``rest`` on standard input asks, as a program writes it; else the key
        ``z``, where there is a terminal.
    lessons
        That lines ``learn NAME`` or ``learn NAME at SPEED`` begin, and ``learn`` ends.
    """
    if lines:
        _listen(partial(_take_lines, lessons), set_rest)
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


def _take_lines(lessons: "Lessons | None", set_rest: Callable[[], object]) -> None:
    for line in map(str.strip, sys.stdin):
        asked = _LESSON.fullmatch(line)
        try:
            if line == LINE:
                set_rest()
            elif asked is None or lessons is None:
                known = f"'{LINE}'" if lessons is None else f"'{LINE}', 'learn NAME' or 'learn'"
                raise InputError(f"expected a line {known}, found '{line}'")
            elif asked["name"]:
                lessons.start(asked["name"], asked["speed"] or "")
            else:
                lessons.stop()
        except InputError as error:
            sys.stderr.write(f"--control: {error}\n")

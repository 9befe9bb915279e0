"""What is requested while it runs: by a key in the terminal, or by a line on standard input."""

import os
import re
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING

from afferents.errors import InputError

if TYPE_CHECKING:
    from afferents.lab.live.lessons import Lessons

KEY, LINE = "z", "rest"
"""That set rest anew."""
_LESSON = re.compile(r"learn(?: +(?P<name>.+?)(?: +at +(?P<speed>[\d.]*\d))?)?")


@contextmanager
def set_rest_on_request(
    set_rest: Callable[[], object], lines: bool = False, lessons: "Lessons | None" = None
) -> Iterator[None]:
    """Call a function at each request, while the inside runs.

    Parameters
    ----------
    set_rest
        Called from a thread of its own.
    lines
        Whether each line ``rest`` on standard input is a request, as a program writes it; else the
        key ``z``, where there is a terminal.
    lessons
        That lines ``learn NAME`` or ``learn NAME at SPEED`` begin, and ``learn`` ends.
    """

    def take_keys() -> None:
        while key := os.read(sys.stdin.fileno(), 1):
            if key == KEY.encode():
                set_rest()

    def take_lines() -> None:
        known = f"'{LINE}'" if lessons is None else f"'{LINE}', 'learn NAME' or 'learn'"
        for line in map(str.strip, sys.stdin):
            lesson = _LESSON.fullmatch(line)
            try:
                if line == LINE:
                    set_rest()
                elif lesson is None or lessons is None:
                    raise InputError(f"expected a line {known}, found '{line}'")
                elif lesson["name"]:
                    lessons.start(lesson["name"], lesson["speed"] or "")
                else:
                    lessons.stop()
            except InputError as error:
                sys.stderr.write(f"--control: {error}\n")

    is_terminal = False  # whose keys come to us: we are not in its background
    with suppress(OSError, ValueError, AttributeError):
        is_terminal = os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    with ExitStack() as restoring:
        if is_terminal and not lines:
            import termios
            import tty

            before = termios.tcgetattr(sys.stdin)
            restoring.callback(termios.tcsetattr, sys.stdin, termios.TCSADRAIN, before)
            tty.setcbreak(sys.stdin)  # keys come at once; Ctrl-C stops as before
        if is_terminal or lines:
            take = take_lines if lines else take_keys
            threading.Thread(target=take, name="afferents-control", daemon=True).start()
        yield

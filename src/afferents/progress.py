"""Progress with remaining time, on streams that may be closed, full, broken, or no terminal."""

import io
import logging
import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from typing import IO, Any, Protocol, Self, TextIO, TypeVar, cast

from rich import progress as bars
from rich.console import Console

LINE_SHARE, LINE_S = 0.1, 30.0
"""A line for every tenth of a task, and after so many seconds."""
LINES_APART_S = 1.0
"""No more lines than that of a task that is quick."""

T = TypeVar("T")


def prepare_streams() -> None:
    r"""Let nothing that is printed fail for its letters, and let a closed stream be /dev/null.

    Else the next file to be opened would take the closed one's place, and what is printed end up
    in it. Letters that a stream can't take, such as those of a file name that is no text, are
    printed as ``\udcff``.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
            os.set_inheritable(number, True)  # workers look for it too
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            stream = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115  for good
            setattr(sys, name, stream)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def silence_libraries() -> None:
    """Let no warning or log of a library reach the terminal, unless ``python -W`` wants warnings.

    What matters of them to a user is said in sentences of ours.
    """
    logging.captureWarnings(not sys.warnoptions)
    logging.basicConfig(handlers=[logging.NullHandler()])


def printable(text: str) -> str:
    r"""Return text that any file can hold: what is no letter becomes ``\udcff``."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def flush_streams() -> OSError | None:
    """Write what is held back; return what kept stdout from taking it.

    The interpreter would try it again at its end, and complain: what can't be written is let go.
    """
    fault = None
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            fault = error if stream is sys.stdout else fault
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
                stream.flush()
    return fault


class Unfailing:
    """A stream that lets go of what it can't write: progress is not worth the work it shows."""

    def __init__(self, stream: TextIO) -> None:
        """Write to `stream`."""
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        """Be like the stream in everything else."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, if that can be done."""
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush, if that can be done."""
        with suppress(OSError):
            self._stream.flush()


class Mark(Protocol):
    """Sets how much of a task is done and what is being worked on."""

    def __call__(self, completed: float, text: str = "") -> None:
        """Show `completed` of the task's total, and `text` beside it."""
        ...


class Progress:
    """Bars for the work of a command, or lines; use as a context manager.

    Parameters
    ----------
    quiet
        Show nothing but notes, and those without colour: for logs and scripts.
    """

    def __init__(self, quiet: bool = False) -> None:
        stderr = cast("IO[str]", Unfailing(sys.stderr))
        console = Console(file=stderr, no_color=quiet, highlight=False, soft_wrap=True)
        self._bars = bars.Progress(
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.TaskProgressColumn(),
            bars.TimeElapsedColumn(),
            bars.TextColumn("left"),
            bars.TimeRemainingColumn(),
            bars.TextColumn("{task.fields[text]}"),
            console=console,
            disable=quiet,
        )
        draws = console.is_jupyter or (console.file.isatty() and not console.is_dumb_terminal)
        self._says = not (quiet or draws)

    def __enter__(self) -> Self:
        """Drawing starts with the first task."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop drawing."""
        if self._bars.live.is_started:
            self._bars.stop()

    def note(self, text: str) -> None:
        """Print a line above the bars."""
        self._bars.console.print(text, markup=False, emoji=False)

    def track(self, items: Iterable[T], label: str, total: int) -> Iterator[T]:
        """Yield the items, a step of the bar each."""
        with self.task(label, total) as mark:
            for done, item in enumerate(items):
                mark(done)
                yield item
                mark(done + 1)

    @contextmanager
    def task(self, label: str, total: float) -> Iterator[Mark]:
        """Show a bar while the block runs; call what it yields to move it."""
        if self._says:
            yield from self._in_lines(label, total)
            return
        self._bars.start()
        task = self._bars.add_task(label, total=total, text="")

        def mark(completed: float, text: str = "") -> None:
            self._bars.update(task, completed=completed, text=text)

        yield mark

    def _in_lines(self, label: str, total: float) -> Iterator[Mark]:
        """Say in lines how far a task is: that it begins, some on the way, and its end."""
        begun_s = said_s = time.monotonic()
        said = 0.0
        self.note(f"{label} ...")

        def mark(completed: float, text: str = "") -> None:
            nonlocal said, said_s
            now_s, share = time.monotonic(), completed / total if total else 1.0
            rested_s = now_s - said_s
            due = rested_s >= LINE_S or (
                share - said >= LINE_SHARE * (1 - 1e-9) and rested_s >= LINES_APART_S
            )
            if due and 0 < share < 1:
                said, said_s = share, now_s
                gone_s = now_s - begun_s
                left = _clock(gone_s * (1 - share) / share)
                known = f"{label}: {share:.0%}, {_clock(gone_s)}, left {left}"
                self.note(f"{known}, {text}" if text else known)

        yield mark
        self.note(f"{label}: done, {_clock(time.monotonic() - begun_s)}")


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))

"""stdout and stderr whatever they are: closed, full, broken, or in an encoding of few letters."""

import io
import os
import sys
from contextlib import suppress
from typing import IO, Any, TextIO, cast


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
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


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


def unfailing_stderr() -> IO[str]:
    """Return stderr, where nothing fails."""
    return cast("IO[str]", Unfailing(sys.stderr))


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123  for good

"""What goes wrong in serving, told in a line: visitors must not fill a terminal or a disk."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_LOGGERS = ("uvicorn.error", "asyncio")


class _OneLine(logging.Handler):
    """Tell the first error in a line, and no other."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)  # what visitors do wrong are warnings
        self._has_written = False

    def emit(self, record: logging.LogRecord) -> None:
        if self._has_written:
            return
        self._has_written = True
        what = record.getMessage().strip().partition("\n")[0]
        error = record.exc_info[1] if record.exc_info else None
        why = "" if error is None else f": {error!r}".replace("\n", " ")
        sys.stderr.write(f"Page: {what}{why} (further ones like it are not printed)\n")
        sys.stderr.flush()


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Let the server and its event loop tell their first error in a line, and nothing else."""
    handler = _OneLine()
    before = {name: logging.getLogger(name).propagate for name in _LOGGERS}
    for name in _LOGGERS:
        logging.getLogger(name).addHandler(handler)
        logging.getLogger(name).propagate = False
    try:
        yield
    finally:
        for name, propagate in before.items():
            logging.getLogger(name).removeHandler(handler)
            logging.getLogger(name).propagate = propagate

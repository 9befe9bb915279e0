"""The door of the page: where it is, who comes in, and what goes wrong, in a line."""

import ipaddress
import logging
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from afferents.choices import require_number
from afferents.errors import InputError

# What goes wrong in serving, told in a line: visitors must not fill a terminal or a disk.

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


# The door: where it is, and who comes in.

LEAST_TOKEN = 8
_SEND_BUFFER = 1 << 18
"""What the system holds back for a visitor who is slow, bytes; else megabytes, of old pictures."""


def open_door(host: str, port: int) -> socket.socket:
    """Listen at an address.

    Raises
    ------
    InputError
        If it is taken, not this machine's, or no port.
    """
    require_number("--port", port, 0, 65535)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        door = socket.create_server((host, port), family=family)
    except OSError as error:
        raise InputError(
            f"--port {port}: expected an address of this machine that is free, {host}, found "
            f"{error.strerror or error!s}; take another --port"
        ) from error
    door.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)  # visitors inherit it
    return door


def check_address(host: str, token: str | None) -> None:
    """Refuse to show a lab to the network by accident.

    Raises
    ------
    InputError
        If others could reach the page without a token, or the token is too short.
    """
    if token is not None and len(token) < LEAST_TOKEN:
        raise InputError(f"--token: expected at least {LEAST_TOKEN} characters, found {len(token)}")
    if not is_loopback(host) and token is None:
        raise InputError(
            f"--host: expected this machine's own address without --token, found {host}; add "
            "--token WORD, which visitors must give"
        )


def is_loopback(host: str) -> bool:
    """Tell whether only this machine reaches an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False

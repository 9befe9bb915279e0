"""The door of the page: who comes in, what a visitor may take, and what goes wrong, in a line."""

import ipaddress
import logging
import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

from afferents.errors import InputError

CEILING = 64
"""More visitors at a time than that are not let in, however many files may be open."""
RESERVE = 24
"""Files left for cameras, sound cards, libraries and the server's own loop."""
_OF_A_VISITOR = 2
"""Its connection, and the file of the page that is being sent to it."""


def affordable() -> int:
    """Return how many connections at a time this process has files for, of those not open yet.

    At least one: a machine so short of files is better told by whatever fails first.
    """
    try:
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        opened = len(os.listdir("/dev/fd"))  # noqa: PTH208  names, of what may be gone again
    except (ImportError, OSError):
        return CEILING  # a system without such a limit, or that does not tell
    if most == resource.RLIM_INFINITY:
        return CEILING
    return max(1, min(CEILING, (most - opened - RESERVE) // _OF_A_VISITOR))


@dataclass(frozen=True)
class Limits:
    """What visitors may take, asked before any token.

    Parameters
    ----------
    places
        Connections at a time, in all.
    request_s
        From the beginning of a connection to the end of the answer, s; a connection has one
        request.
    taking_s
        For what is sent to a web socket to be on its way, s.
    saying
        What a web socket may say at once, bytes.
    saying_hz
        And on and on, bytes per second.
    """

    places: int = field(default_factory=affordable)
    request_s: float = 10.0
    taking_s: float = 10.0
    saying: int = 1 << 16
    saying_hz: float = 1024.0


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


# The door of the page: where it is, and who comes in, before anything is asked or read.

LEAST_TOKEN = 8
_SENT_S = 0.001
"""Rest after a visitor was sent away, in which the stream has the machine to itself."""
_SHORT_S = 0.1
"""Rest when the system has no file for a visitor, not even to send it away."""
_SEND_BUFFER = 1 << 18
"""What the system holds back for a visitor who is slow, bytes; else megabytes, of old pictures."""
_FULL = b"All places are taken. Try again in a moment.\n"
_AWAY = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nConnection: close\r\n"
    b"Content-Length: %d\r\n\r\n%b" % (len(_FULL), _FULL)
)


class Door(socket.socket):
    """A listening socket that lets in as many as there are places, and sends others away.

    It counts where the connection comes to be: the event loop takes a whole queue of connections
    before it looks at the first, so that whoever counts later has no files left to count with.

    Parameters
    ----------
    listening
        A socket that listens; taken over.
    places
        Connections at a time. Half of them may be of one address, unless it is this machine's
        own: behind that are all its users, and a proxy's visitors.
    """

    def __init__(self, listening: socket.socket, places: int) -> None:
        """Open."""
        family, kind, protocol = listening.family, listening.type, listening.proto
        super().__init__(family, kind, protocol, listening.detach())
        self._places = places
        self._inside: WeakKeyDictionary[socket.socket, str] = WeakKeyDictionary()
        self.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)  # visitors inherit it

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next visitor and its address.

        Raises
        ------
        BlockingIOError
            If there is nobody, or nobody that could be let in; ask again.
        """
        try:
            visitor, address = super().accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            raise
        except OSError as error:  # no files, no memory: it may have some again soon
            time.sleep(_SHORT_S)
            raise BlockingIOError from error
        if self._has_place(address[0]):
            self._inside[visitor] = address[0]
            return visitor, address
        _send_away(visitor)
        raise BlockingIOError

    def _has_place(self, host: str) -> bool:
        hosts = [inside for visitor, inside in self._inside.items() if visitor.fileno() >= 0]
        if len(hosts) >= self._places:
            return False
        return is_loopback(host) or hosts.count(host) < max(1, self._places // 2)


def _send_away(visitor: socket.socket) -> None:
    with visitor, suppress(OSError):
        visitor.setblocking(False)
        visitor.send(_AWAY)
        visitor.recv(1 << 16)  # what is left unread would take the answer back
    time.sleep(_SENT_S)


def open_door(host: str, port: int, places: int) -> Door:
    """Listen at an address.

    Raises
    ------
    InputError
        If it is taken, or not this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return Door(socket.create_server((host, port), family=family), places)
    except OSError as error:
        raise InputError(
            f"--port {port}: expected an address of this machine that is free, {host}, found "
            f"{error.strerror or error!s}; take another --port"
        ) from error


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

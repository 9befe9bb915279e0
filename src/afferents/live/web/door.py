"""The door of the page: where it is, and who comes in, before anything is asked or read."""

import ipaddress
import socket
import time
from contextlib import suppress
from typing import Any
from weakref import WeakKeyDictionary

from afferents.core.errors import InputError

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
            f"--port {port}", f"an address of this machine that is free, {host}",
            str(error.strerror or error), "take another --port",
        ) from error  # fmt: skip


def check_address(host: str, token: str | None) -> None:
    """Refuse to show a lab to the network by accident.

    Raises
    ------
    InputError
        If others could reach the page without a token, or the token is too short.
    """
    if token is not None and len(token) < LEAST_TOKEN:
        raise InputError("--token", f"at least {LEAST_TOKEN} characters", f"{len(token)}")
    if not is_loopback(host) and token is None:
        raise InputError(
            "--host", "this machine's own address without --token", host,
            "add --token WORD, which visitors must give",
        )  # fmt: skip


def is_loopback(host: str) -> bool:
    """Tell whether only this machine reaches an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False

"""The door of the page: the address it listens at, and who may come in."""

import ipaddress
import socket

from afferents.choices import require_number
from afferents.errors import InputError

LEAST_TOKEN = 8
_SEND_BUFFER = 1 << 18
"""What the system holds back for a slow visitor, bytes; else megabytes, of old pictures."""


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
    """Return whether only this machine reaches an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False

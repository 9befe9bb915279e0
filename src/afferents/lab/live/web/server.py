"""Serving the page while a command runs: predictions, or whatever else is shown."""

import ipaddress
import logging
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from types import MappingProxyType
from typing import Any
from urllib.parse import quote

from afferents import choices, plugins
from afferents.errors import InputError
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.web.snapshot import Shown, Snapshots

Request = Callable[[str, Mapping[str, str]], bool]
"""Does what a visitor requests, given its details, and returns whether it can be done now; an
`InputError` says why not."""
WAITING_S = 0.5
"""A page that has nothing new to come sleeps for this time."""
CLOSING_S = 0.5
"""Visitors have this time to get what was sent last."""
LEAST_TOKEN = 8
_SEND_BUFFER = 1 << 18
"""Bytes that the system buffers for a slow visitor; its default is megabytes of old pictures."""
_LOGGERS = ("uvicorn.error", "asyncio")


def serve(
    predictions: Iterable[Prediction],
    pipeline: LivePipeline,
    host: str,
    port: int,
    token: str | None,
    again: Callable[[], Iterable[Prediction]] | None = None,
    greeting: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Show predictions on a page until the user stops.

    Parameters
    ----------
    predictions
        Taken as they come.
    pipeline
        That makes them.
    host, port, token
        As for `serve_page`.
    again
        Begins anew, for a visitor who requests it when the source has ended; None where it can't.
    greeting
        What else visitors are sent at first; see `outlets.give_out`.

    Raises
    ------
    InputError
        As `serve_page`.
    """
    snapshots = Snapshots(pipeline, greeting)
    snapshots.repeats = again is not None
    lessons, wants_again = pipeline.lessons, threading.Event()

    def request(what: str, details: Mapping[str, str]) -> bool:
        if what == "rest":
            return pipeline.set_rest()
        if what == "learn" and lessons is not None:
            lessons.start(details.get("name", ""), details.get("speed", ""))
        elif what == "learnt" and lessons is not None:
            lessons.stop()
        elif what == "again" and snapshots.repeats and snapshots.ended is not None:
            wants_again.set()
        else:
            return False
        return True

    with serve_page(snapshots, host, port, token, request):
        while True:
            for prediction in predictions:
                snapshots.take(prediction)
            snapshots.ended = "the source has ended"
            while not wants_again.wait(WAITING_S):
                pass
            assert again is not None
            snapshots.ended = None
            wants_again.clear()
            predictions = again()


@contextmanager
def serve_page(
    shown: Shown, host: str, port: int, token: str | None, request: Request
) -> Iterator[None]:
    """Serve a page while the inside runs, in a thread of its own.

    Parameters
    ----------
    shown
        What visitors are sent; called in the server's thread.
    host, port
        Where; port 0 for any that is free.
    token
        Word that visitors must give as `?token=`; None for none.
    request
        See `Request`.

    Raises
    ------
    InputError
        If the address is not this machine's own and there is no token; if it is taken; if
        packages are missing.
    """
    check_address(host, token)
    plugins.import_extra("lab", "--web", "starlette", "uvicorn", "websockets")
    import uvicorn  # it and what serves a page take half a second to import

    from afferents.lab.live.web import application

    door = open_door(host, port)
    limits = application.count_places(), application.ANSWERED_S
    connection = partial(application.TimedConnection, *limits)
    config = uvicorn.Config(
        application.make_application(shown, host, token, request),
        loop="asyncio",
        http=connection,  # type: ignore[arg-type]
        ws="websockets-sansio",
        backlog=16,  # taken at once, before the first is counted
        h11_max_incomplete_event_size=1 << 14,
        ws_max_size=1 << 10,  # visitors send nothing of use
        ws_ping_interval=10.0,  # a visitor that takes nothing is cut off
        ws_ping_timeout=10.0,
        ws_per_message_deflate=False,  # pictures are compressed already
        log_config=None,
        log_level="error",
        access_log=False,
        timeout_graceful_shutdown=1,  # visitors do not keep it from stopping
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(
        target=partial(server.run, sockets=[door]), name="afferents-page", daemon=True
    )
    query = "" if token is None else f"/?token={quote(token, safe='')}"
    address = f"[{host}]" if ":" in host else host
    with one_line_errors():
        thread.start()
        sys.stderr.write(f"Page: http://{address}:{door.getsockname()[1]}{query}\n")
        sys.stderr.flush()
        try:
            yield
        finally:
            time.sleep(CLOSING_S)
            server.should_exit = True
            thread.join(CLOSING_S + 2.0)


def open_door(host: str, port: int) -> socket.socket:
    """Listen at an address.

    Raises
    ------
    InputError
        If it is taken, not this machine's, or no port.
    """
    choices.require_number("--port", port, 0, 65535)
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


class _OneLine(logging.Handler):
    """Prints the first error in a line, and no other."""

    def emit(self, record: logging.LogRecord) -> None:
        self.setLevel(logging.CRITICAL + 1)
        what = record.getMessage().strip().partition("\n")[0]
        error = record.exc_info[1] if record.exc_info else None
        why = "" if error is None else f": {error!r}".replace("\n", " ")
        sys.stderr.write(f"Page: {what}{why} (further ones like it are not printed)\n")
        sys.stderr.flush()


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Let the server and its event loop print their first error in a line, and nothing else.

    Visitors must not fill a terminal or a disk.
    """
    handler = _OneLine(logging.ERROR)  # what visitors do wrong are warnings
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

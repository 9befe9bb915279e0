"""A page beside a command that goes on in the main thread."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from afferents.live.web.limits import Limits
from afferents.live.web.quiet import one_line_errors
from afferents.live.web.server import Shown, say_where, server_of

LAST_S = 0.5
"""Visitors are left so long to get what was said last."""


@contextmanager
def page_beside(
    shown: Shown,
    host: str,
    port: int,
    token: str | None,
    request: Callable[[str], bool] | None = None,
) -> Iterator[None]:
    """Serve a page while the inside runs.

    Parameters
    ----------
    shown
        What visitors are sent; asked in the server's thread.
    host, port, token
        As for `serve`.
    request
        Does what a visitor asks, and tells whether it can be done now.

    Raises
    ------
    InputError
        As `serve`.
    """
    server, door = server_of(shown, host, port, token, Limits(), request)
    thread = threading.Thread(
        target=partial(server.run, sockets=[door]), name="afferents-page", daemon=True
    )
    with one_line_errors():
        thread.start()
        say_where(host, door, token)
        try:
            yield
        finally:
            time.sleep(LAST_S)
            server.should_exit = True
            thread.join(LAST_S + 2.0)

"""Serving the page: a small ASGI application on one socket, in a thread of its own."""

import asyncio
import hmac
import json
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any
from urllib.parse import quote, urlsplit

from afferents.errors import InputError
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.web.door import check_address, is_loopback, one_line_errors, open_door
from afferents.lab.live.web.snapshot import Shown, Snapshots
from afferents.plugins import import_extra

PAGE = Path(str(files("afferents.lab.live.web"))) / "page"
EVERY_S = 0.05
"""A visitor is sent what is new this often, and no more often than it can take."""

Asked = Callable[[str, Mapping[str, str]], bool]
"""Does what a visitor asks, which may be said more closely, and tells whether it can be done now;
an `InputError` says why not."""

WAITING_S = 0.5
"""A page that has nothing new to come sleeps for so long."""


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
        As for `page_beside`.
    again
        Begins anew, for a visitor who asks for it when the source has ended; None where it can't.
    greeting
        What else visitors are told at first; see `outlets.give_out`.

    Raises
    ------
    InputError
        As `page_beside`.
    """
    snapshots = Snapshots(pipeline, greeting)
    snapshots.repeats = again is not None
    asked = threading.Event()

    def request(what: str, said: Mapping[str, str]) -> bool:
        if what == "rest":
            return pipeline.set_rest()
        if what == "learn" and pipeline.lessons is not None:
            pipeline.lessons.start(said.get("name", ""), said.get("speed", ""))
            return True
        if what == "learnt" and pipeline.lessons is not None:
            pipeline.lessons.stop()
            return True
        can = what == "again" and snapshots.repeats and snapshots.ended is not None
        if can:
            asked.set()
        return can

    with page_beside(snapshots, host, port, token, request):
        while True:
            for prediction in predictions:
                snapshots.take(prediction)
            snapshots.ended = "the source has ended"
            while not asked.wait(WAITING_S):
                pass
            assert again is not None
            snapshots.ended = None
            asked.clear()
            predictions = again()


def application(shown: Shown, host: str, token: str | None, request: Asked) -> Any:
    """Return the ASGI application: the page, its files, one web socket, and what may be asked."""
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import Request
    from starlette.responses import FileResponse, PlainTextResponse, Response
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles
    from starlette.websockets import WebSocket, WebSocketDisconnect

    def knows_token(given: str | None) -> bool:
        return token is None or hmac.compare_digest((given or "").encode(), token.encode())

    async def page(request: Request) -> Response:
        if not knows_token(request.query_params.get("token")):
            return PlainTextResponse("The token is missing or wrong: add ?token=...", 403)
        return FileResponse(PAGE / "index.html")

    async def feed(visitor: WebSocket) -> None:
        with suppress(WebSocketDisconnect, RuntimeError, ConnectionError):  # it may go any time
            if not knows_token(visitor.query_params.get("token")) or not _same_origin(visitor):
                await visitor.close(1008)
                return
            await visitor.accept()
            await _attend(visitor, shown)

    async def do(asked: Request) -> Response:
        if not knows_token(asked.query_params.get("token")) or not _same_origin(asked):
            return PlainTextResponse(
                "The token is missing or wrong, or the page is another's.", 403
            )
        try:
            done = request(asked.path_params["what"], asked.query_params)
        except InputError as error:
            return PlainTextResponse(str(error), 409)
        return PlainTextResponse("done" if done else "not now", 200 if done else 409)

    # Pages elsewhere whose name is made to point here are sent away (DNS rebinding).
    own = ["127.0.0.1", "localhost", "[::1]", host] if is_loopback(host) else ["*"]
    routed = Starlette(
        routes=[
            Route("/", page),
            WebSocketRoute("/feel", feed),
            Route("/do/{what}", do, methods=["POST"]),
            Mount("/page", StaticFiles(directory=PAGE)),
        ],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=own)],
    )
    return _one_answer(routed)


def _one_answer(app: Any) -> Any:
    """Close every connection after an answer, as each has one place and one time limit."""

    async def answered(scope: Any, receive: Any, send: Any) -> None:
        async def send_last(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), (b"connection", b"close")]
            await send(message)

        await app(scope, receive, send_last)

    return answered


async def _attend(visitor: Any, shown: Shown) -> None:
    """Send a visitor the newest of everything until it goes; whatever it says is not heeded."""

    async def listen() -> None:
        while (await visitor.receive())["type"] != "websocket.disconnect":
            pass

    gone = asyncio.create_task(listen())
    try:
        hello = ""
        while not gone.done():
            if (now := json.dumps(shown.hello())) != hello:  # more may be taught
                hello = now
                await visitor.send_text(hello)
            state, jpeg = shown.newest()
            await visitor.send_text(state)
            if jpeg is not None:
                await visitor.send_bytes(jpeg)
            await asyncio.sleep(EVERY_S)
    finally:
        gone.cancel()
        with suppress(asyncio.CancelledError, RuntimeError):
            await gone


def _same_origin(visitor: Any) -> bool:
    """Tell whether the page that opens the socket is ours; programs name none."""
    origin = visitor.headers.get("origin")
    try:
        return origin is None or urlsplit(origin).netloc == visitor.headers.get("host")
    except ValueError:  # no address at all
        return False


# A page beside a command that goes on in the main thread.

CLOSING_S = 0.5
"""Visitors are left so long to get what was said last."""


@contextmanager
def page_beside(
    shown: Shown,
    host: str,
    port: int,
    token: str | None,
    request: Asked,
) -> Iterator[None]:
    """Serve a page while the inside runs.

    Parameters
    ----------
    shown
        What visitors are sent; asked in the server's thread.
    host, port
        Where; port 0 for any that is free.
    token
        Word that visitors must give as `?token=`; None for none.
    request
        See `Asked`.

    Raises
    ------
    InputError
        If the address is not this machine's own and there is no token; if it is taken; if
        packages are missing.
    """
    check_address(host, token)
    import_extra("lab", "--web", "starlette", "uvicorn", "websockets")
    import uvicorn  # it and what serves a page take half a second to import

    from afferents.lab.live.web.guard import (  # of uvicorn's
        ANSWERED_S,
        TimedConnection,
        count_places,
    )

    door = open_door(host, port)
    config = uvicorn.Config(
        application(shown, host, token, request),
        loop="asyncio",
        http=partial(TimedConnection, count_places(), ANSWERED_S),  # type: ignore[arg-type]
        ws="websockets-sansio",
        backlog=16,  # so many are taken at once before the first is counted
        h11_max_incomplete_event_size=1 << 14,
        ws_max_size=1 << 10,  # visitors have nothing to say
        ws_ping_interval=10.0,  # who takes nothing is cut off
        ws_ping_timeout=10.0,
        ws_per_message_deflate=False,  # pictures are compressed already
        log_config=None,
        log_level="error",
        access_log=False,
        timeout_graceful_shutdown=1,  # who looks on does not keep it from stopping
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

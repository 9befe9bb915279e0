"""The application of the page: its files, its web socket, requests, and what a visitor may take.

A visitor that shows no token has one of a few places, and some time.
"""

import asyncio
import hmac
import json
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol

from afferents.errors import InputError
from afferents.lab.live.web.server import Request, is_loopback
from afferents.lab.live.web.snapshot import Shown

PAGE = Path(str(files("afferents.lab.live.web"))) / "page"
EVERY_S = 0.05
"""A visitor is sent what is new this often, and no more often than it can take."""


PLACES = 64
"""Connections at a time; a quarter of the files that the process may open, where that is less."""
ANSWERED_S = 10.0
"""From the beginning of a connection to the end of its one answer, s."""
_FULL = b"All places are taken. Try again in a moment.\n"
_AWAY = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nConnection: close\r\n"
    b"Content-Length: %d\r\n\r\n%b" % (len(_FULL), _FULL)
)


def make_application(shown: Shown, host: str, token: str | None, request: Request) -> Any:
    """Return the ASGI application: the page, its files, one web socket, and requests."""

    def knows_token(visitor: HTTPConnection) -> bool:
        given = visitor.query_params.get("token") or ""
        return token is None or hmac.compare_digest(given.encode(), token.encode())

    async def page(visitor: Any) -> Response:
        if not knows_token(visitor):
            return PlainTextResponse("The token is missing or wrong: add ?token=...", 403)
        return FileResponse(PAGE / "index.html")

    async def feed(visitor: WebSocket) -> None:
        with suppress(WebSocketDisconnect, RuntimeError, ConnectionError):  # it may go any time
            if not knows_token(visitor) or not _is_same_origin(visitor):
                await visitor.close(1008)
                return
            await visitor.accept()
            await _attend(visitor, shown)

    async def do(visitor: Any) -> Response:
        if not knows_token(visitor) or not _is_same_origin(visitor):
            return PlainTextResponse(
                "The token is missing or wrong, or the page is another's.", 403
            )
        try:
            done = request(visitor.path_params["what"], visitor.query_params)
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

    async def answer_once(scope: Any, receive: Any, send: Any) -> None:
        """Close every connection after an answer: each has one place and one time limit."""

        async def send_last(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), (b"connection", b"close")]
            await send(message)

        await routed(scope, receive, send_last)

    return answer_once


async def _attend(visitor: Any, shown: Shown) -> None:
    """Send a visitor the newest of everything until it goes; what it sends is ignored."""

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


def _is_same_origin(visitor: Any) -> bool:
    """Return whether the page that opens the socket is ours; programs name none."""
    origin = visitor.headers.get("origin")
    try:
        return origin is None or urlsplit(origin).netloc == visitor.headers.get("host")
    except ValueError:  # no address at all
        return False


def count_places() -> int:
    """Count the places that there are."""
    try:
        import resource
    except ImportError:  # Windows, which has no such limit
        return PLACES
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return PLACES if files == resource.RLIM_INFINITY else min(PLACES, max(1, files // 4))


class TimedConnection(H11Protocol):
    """A connection for one request, answered in time or cut off.

    uvicorn's own limits begin with a whole request. One limit for the whole of it bounds a head
    that comes a byte a second, a body without end, an answer that is not taken, and a connection
    on which nothing is sent at all.

    Parameters
    ----------
    places
        Connections at a time.
    answered_s
        See `ANSWERED_S`.
    """

    def __init__(self, places: int, answered_s: float, **uvicorns: Any) -> None:
        """No visitor is there yet."""
        super().__init__(**uvicorns)
        self._places, self._answered_s = places, answered_s

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to count its time, or send it away."""
        super().connection_made(transport)
        if len(self.connections) > self._places:
            transport.write(_AWAY)
            transport.close()

        def cut() -> None:
            protocol = self.transport.get_protocol()
            if not getattr(protocol, "handshake_complete", False):  # else it is a web socket by now
                self.transport.abort()

        self._end = self.loop.call_later(self._answered_s, cut)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop counting."""
        self._end.cancel()
        super().connection_lost(exc)

"""Serving the page: a small ASGI application on one socket, the stream in a thread of its own."""

import asyncio
import hmac
import ipaddress
import json
import socket
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from afferents.core.errors import InputError
from afferents.core.extras import import_extra
from afferents.live.feeler import Feeler
from afferents.live.percept import Percept
from afferents.live.web.snapshot import Snapshots

PAGE = Path(str(files("afferents.live.web"))) / "page"
EVERY_S = 0.05
"""A visitor is sent what is new this often, and no more often than it can take."""
LEAST_TOKEN = 8


def serve(
    percepts: Iterator[Percept], feeler: Feeler, host: str, port: int, token: str | None
) -> None:
    """Show percepts on a page until the user stops.

    Parameters
    ----------
    percepts
        Taken by a thread of its own.
    feeler
        That makes them.
    host, port
        Where; port 0 for any that is free.
    token
        Word that visitors must give as `?token=`; None for none.

    Raises
    ------
    InputError
        If the address is not this machine's own and there is no token; if it is taken; if
        packages are missing.
    Exception
        Whatever ended the stream.
    """
    check_address(host, token)
    uvicorn = import_extra("live", "--web", "uvicorn", "starlette", "websockets")
    snapshots = Snapshots(feeler)
    bound = _bound(host, port)
    config = uvicorn.Config(
        application(snapshots, host, token),
        log_level="warning",
        ws_max_size=1 << 16,
        timeout_graceful_shutdown=1,  # who looks on does not keep it from stopping
    )
    server = uvicorn.Server(config)
    failed: list[BaseException] = []

    def feel() -> None:
        try:
            for percept in percepts:
                snapshots.take(percept)
            snapshots.ended = "the source has ended"
        except BaseException as error:  # noqa: BLE001  raised when the server has stopped
            failed.append(error)
            server.should_exit = True

    threading.Thread(target=feel, name="afferents-stream", daemon=True).start()
    shown = f"[{host}]" if ":" in host else host
    query = "" if token is None else f"/?token={quote(token, safe='')}"
    sys.stderr.write(f"Page: http://{shown}:{bound.getsockname()[1]}{query}\n")
    sys.stderr.flush()
    server.run(sockets=[bound])
    if failed:
        raise failed[0]


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


def application(snapshots: Snapshots, host: str, token: str | None) -> Any:
    """Return the ASGI application: the page, its files, and one web socket."""
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import Request
    from starlette.responses import FileResponse, PlainTextResponse, Response
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles
    from starlette.websockets import WebSocket

    def knows_token(given: str | None) -> bool:
        return token is None or hmac.compare_digest((given or "").encode(), token.encode())

    async def page(request: Request) -> Response:
        if not knows_token(request.query_params.get("token")):
            return PlainTextResponse("The token is missing or wrong: add ?token=...", 403)
        return FileResponse(PAGE / "index.html")

    async def feed(visitor: WebSocket) -> None:
        if not knows_token(visitor.query_params.get("token")) or not _same_origin(visitor):
            await visitor.close(1008)
            return
        await visitor.accept()
        await _attend(visitor, snapshots)

    # Pages elsewhere whose name is made to point here are sent away (DNS rebinding).
    own = ["127.0.0.1", "localhost", "[::1]", host] if is_loopback(host) else ["*"]
    return Starlette(
        routes=[
            Route("/", page),
            WebSocketRoute("/feel", feed),
            Mount("/page", StaticFiles(directory=PAGE)),
        ],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=own)],
    )


async def _attend(visitor: Any, snapshots: Snapshots) -> None:
    """Send a visitor the newest of everything until it goes; whatever it says is not heeded."""
    from starlette.websockets import WebSocketDisconnect

    async def listen() -> None:
        while (await visitor.receive())["type"] != "websocket.disconnect":
            pass

    async with _in_background(listen()) as gone:
        with suppress(WebSocketDisconnect, RuntimeError, ConnectionError):
            await visitor.send_text(json.dumps(snapshots.hello()))
            while not gone.done():
                await visitor.send_text(json.dumps(snapshots.state()))
                if (jpeg := snapshots.jpeg()) is not None:
                    await visitor.send_bytes(jpeg)
                await asyncio.sleep(EVERY_S)


@asynccontextmanager
async def _in_background(work: Any) -> AsyncIterator["asyncio.Task[None]"]:
    task = asyncio.create_task(work)
    try:
        yield task
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError, RuntimeError):
            await task


def _same_origin(visitor: Any) -> bool:
    """Tell whether the page that opens the socket is ours; programs name none."""
    origin = visitor.headers.get("origin")
    return origin is None or urlsplit(origin).netloc == visitor.headers.get("host")


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise InputError(
            f"--port {port}", f"an address of this machine that is free, {host}",
            str(error.strerror or error), "take another --port",
        ) from error  # fmt: skip

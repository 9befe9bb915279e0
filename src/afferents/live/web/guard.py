"""Uvicorn's two protocols, with an end to what a visitor may take."""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from afferents.live.web.door import Limits


class OneRequest(H11Protocol):
    """A connection for one request, answered or cut off in time.

    One limit for the whole of it bounds a head that comes a byte a second, a body without end,
    an answer that nobody takes, a web socket that does not come about, and a connection on which
    nothing is said at all.
    """

    def __init__(self, limits: Limits, **uvicorns: Any) -> None:
        """Nobody is there yet."""
        super().__init__(**uvicorns)
        self._limits = limits
        self._end: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to count its time."""
        super().connection_made(transport)
        self._end = self.loop.call_later(self._limits.request_s, self._cut)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop counting."""
        _cancel(self._end)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read; what can't be understood ends the connection, and nothing else."""
        try:
            super().data_received(data)
        except Exception:  # noqa: BLE001  asyncio would tell it in a page of traceback
            self.transport.abort()

    def shutdown(self) -> None:
        """End with the server, which waits for nobody."""
        self.transport.abort()

    def _cut(self) -> None:
        speaks = self.transport.get_protocol()
        if not (isinstance(speaks, Onlooker) and speaks.handshake_complete):
            self.transport.abort()


class Onlooker(WebSocketsSansIOProtocol):
    """A web socket that must take what it is sent, and may say little.

    One message at a time is under way to it, beyond what the system's buffer holds; and what it
    says is not kept.
    """

    def __init__(self, limits: Limits, **uvicorns: Any) -> None:
        """Nobody is there yet."""
        super().__init__(**uvicorns)
        self._limits = limits
        self._may_say, self._said_s = float(limits.saying), self.loop.time()
        self._stuck: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Let the transport tell as soon as the visitor does not take all at once."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=0)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop counting."""
        _cancel(self._stuck)
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Begin to count how long it takes nothing."""
        super().pause_writing()
        self._stuck = self.loop.call_later(self._limits.taking_s, self.transport.abort)

    def resume_writing(self) -> None:
        """Stop counting: it has taken everything."""
        _cancel(self._stuck)
        super().resume_writing()

    def data_received(self, data: bytes) -> None:
        """Read; who says too much, or what can't be understood, is cut off."""
        now_s = self.loop.time()
        grown = self._may_say + (now_s - self._said_s) * self._limits.saying_hz
        self._may_say = min(grown, self._limits.saying) - len(data)
        self._said_s = now_s
        try:
            if self._may_say < 0:
                raise BufferError
            super().data_received(data)
        except Exception:  # noqa: BLE001  asyncio would tell it in a page of traceback
            self.transport.abort()

    def handle_text(self, event: Frame) -> None:
        """Nobody heeds it."""

    def handle_bytes(self, event: Frame) -> None:
        """Nobody heeds it."""

    def handle_cont(self, event: Frame) -> None:
        """Nobody heeds it."""

    def shutdown(self) -> None:
        """End with the server: say so to who listens, and wait for nobody."""
        super().shutdown()
        if self.transport.get_write_buffer_size():
            self.transport.abort()


def _cancel(timer: asyncio.TimerHandle | None) -> None:
    if timer is not None:
        timer.cancel()

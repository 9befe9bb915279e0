"""Limits to what a visitor may take before it shows a token: a place, and some time."""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

PLACES = 64
"""Connections at a time; a quarter of the files that the process may open, where that is less."""
ANSWERED_S = 10.0
"""From the beginning of a connection to the end of its one answer, s."""
_FULL = b"All places are taken. Try again in a moment.\n"
_AWAY = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nConnection: close\r\n"
    b"Content-Length: %d\r\n\r\n%b" % (len(_FULL), _FULL)
)


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

"""Where the threads of sources leave events, and the stream takes them: bounded, newest first."""

import threading
import time
from collections import deque

from afferents.live.events import CameraFrame, Channel, Event, Source

WAITING_FRAMES = 4
"""More frames than that are not kept waiting: who is too slow skips the oldest."""
WAITING_SOUNDS = 100


class Mailbox:
    """Events of several sources, in the order of their arrival."""

    def __init__(self) -> None:
        """Start empty."""
        self._events: deque[Event] = deque()
        self._changed = threading.Condition()
        self._open = 0
        self._errors: list[BaseException] = []
        self.last_s: dict[Channel, float] = {}
        """When each channel's last event came."""

    def take_from(self, source: Source) -> None:
        """Let a thread of its own take what a source gives."""
        self._open += 1
        name = f"afferents-{source.channel}"
        threading.Thread(target=self._pump, args=(source,), name=name, daemon=True).start()

    def get(self, timeout_s: float) -> Event | None:
        """Return the next event, or None where none came in time.

        Raises
        ------
        EOFError
            If all sources have ended and nothing is left.
        """
        with self._changed:
            until_s = time.monotonic() + timeout_s
            while not self._events:
                if self._errors:
                    raise self._errors.pop()
                if not self._open:
                    raise EOFError
                if (left_s := until_s - time.monotonic()) <= 0:
                    return None
                self._changed.wait(left_s)
            return self._events.popleft()

    def _pump(self, source: Source) -> None:
        try:
            for event in source.events():
                self._put(event)
        except BaseException as error:  # noqa: BLE001  passed on to who takes the events
            with self._changed:
                self._errors.append(error)
        with self._changed:
            self._open -= 1
            self._changed.notify()

    def _put(self, event: Event) -> None:
        with self._changed:
            same = [i for i, e in enumerate(self._events) if type(e) is type(event)]
            most = WAITING_FRAMES if isinstance(event, CameraFrame) else WAITING_SOUNDS
            if len(same) >= most:
                del self._events[same[0]]
            self._events.append(event)
            self.last_s[event.channel] = time.monotonic()
            self._changed.notify()

"""Taking events: of running sources as they come, of recordings in the order of their times."""

import heapq
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from operator import attrgetter

from afferents.lab.live.events import CameraFrame, Channel, Event, Source

WAITING_FRAMES = 4
"""More frames than that are not kept waiting: a reader that is too slow skips the oldest."""
WAITING_SOUNDS = 100
AHEAD = 32
"""Events of a recording that are read ahead: decoding on one core, classifying on another."""


class Mailbox:
    """Events of several running sources, in the order of their arrival.

    Attributes
    ----------
    last_s
        When each channel's last event came, taken or not, on the monotonic clock, s.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._events: deque[Event] = deque()
        self._changed = threading.Condition()
        self._open = 0
        self._errors: list[BaseException] = []
        self.last_s: dict[Channel, float] = {}

    def take_from(self, source: Source) -> None:
        """Let a thread of its own take what a source gives."""
        self._open += 1
        name = f"afferents-{source.channel}"
        threading.Thread(target=self._pump, args=(source,), name=name, daemon=True).start()

    def take(self, patience_s: float) -> Iterator[Event | None]:
        """Yield events until all sources have ended; None where none came in time.

        What a source raises is raised here.
        """
        while True:
            with self._changed:
                if not self._events and self._open and not self._errors:
                    self._changed.wait(patience_s)
                if self._events:
                    event = self._events.popleft()
                elif self._errors:
                    raise self._errors.pop()
                elif self._open:
                    event = None
                else:
                    return
            yield event

    def _pump(self, source: Source) -> None:
        try:
            for event in source.events():
                self._put(event)
        except BaseException as error:  # noqa: BLE001  raised where the events are taken
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


def take_in_order(
    sources: Iterable[Source], time_of: Callable[[Event], float] = attrgetter("time_s")
) -> Iterator[Event]:
    """Yield the events of recordings in the order of their times, each read a little ahead."""

    def read(events: Iterator[Event], reader: ThreadPoolExecutor) -> Iterator[Event]:
        ahead = deque(reader.submit(next, events, None) for _ in range(AHEAD))
        while (event := ahead.popleft().result()) is not None:
            ahead.append(reader.submit(next, events, None))
            yield event

    with ExitStack() as ending:
        readers = []
        for source in sources:
            reader = ThreadPoolExecutor(1, "afferents-ahead")
            ending.callback(reader.shutdown, cancel_futures=True)
            readers.append(read(source.events(), reader))
        yield from heapq.merge(*readers, key=time_of)

"""Events taken a little ahead by a thread: decoding on one core, feeling on another."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Full, Queue

from afferents.live.events import Event

AHEAD = 32
_PATIENCE_S = 0.1

_Item = Event | BaseException | None


@contextmanager
def read_ahead(events: Iterator[Event]) -> Iterator[Iterator[Event]]:
    """Yield the same events in the same order; the thread ends with the block."""
    taken: Queue[_Item] = Queue(AHEAD)
    enough = threading.Event()

    def give(item: _Item) -> None:
        while not enough.is_set():
            try:
                taken.put(item, timeout=_PATIENCE_S)
            except Full:
                continue
            return

    def read() -> None:
        try:
            for event in events:
                give(event)
                if enough.is_set():
                    return
            give(None)
        except BaseException as error:  # noqa: BLE001  raised where the events are taken
            give(error)

    def in_order() -> Iterator[Event]:
        while (item := taken.get()) is not None:
            if isinstance(item, BaseException):
                raise item
            yield item

    thread = threading.Thread(target=read, name="afferents-ahead", daemon=True)
    thread.start()
    try:
        yield in_order()
    finally:
        enough.set()
        thread.join()

"""What sources give: pictures, sound, and what went wrong; where they wait for who takes them."""

import heapq
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame

Channel = Literal["video", "audio"]


class CameraFrame(NamedTuple):
    """One camera frame.

    Attributes
    ----------
    frame
        As decoded; its time is the camera's, s.
    arrived_s
        When it lay decoded in memory, on this machine's monotonic clock, s.
    torn
        Whether the decoder says that part of it is missing.
    """

    frame: Frame
    arrived_s: float
    torn: bool = False

    @property
    def time_s(self) -> float:
        """When it was taken, on the camera's clock, s."""
        return self.frame.time_s

    @property
    def channel(self) -> Channel:
        """Whence it comes."""
        return "video"


class Sound(NamedTuple):
    """Some vibration samples in a row.

    Attributes
    ----------
    time_s
        When the first was taken, on the microphone's clock, s.
    samples
        (n, channel), float32.
    arrived_s
        When they came, on this machine's monotonic clock, s.
    """

    time_s: float
    samples: NDArray[np.float32]
    arrived_s: float

    @property
    def channel(self) -> Channel:
        """Whence it comes."""
        return "audio"


class Trouble(NamedTuple):
    """Something went wrong: what comes next does not follow what came before."""

    channel: Channel
    time_s: float
    what: str


class Begin(NamedTuple):
    """A new recording begins, with the skin at rest; `truth` is what it touches, if known."""

    channel: Channel
    time_s: float
    truth: str | None = None


Event = CameraFrame | Sound | Trouble | Begin


class Source(Protocol):
    """A camera, a microphone, or what stands in for one.

    Attributes
    ----------
    channel
        What it gives.
    rate_hz
        Frames or samples a second that it has, or was asked for where it says none.
    speed
        Seconds of its clock in a second: 1 for what happens now, so that events are lost if nobody
        takes them in time; infinite for a recording that waits to be taken.
    """

    channel: Channel
    rate_hz: float
    speed: float

    def events(self) -> Iterator[Event]:
        """Yield what happens, in order, until the source ends or is closed."""
        ...

    def close(self) -> None:
        """Let go of the device; `events` then ends."""
        ...


@contextmanager
def let_go(sources: Iterable[Source]) -> Iterator[None]:
    """Close sources afterwards, whatever happens."""
    try:
        yield
    finally:
        for source in sources:
            source.close()


# Where the threads of sources leave events, and the stream takes them: bounded, newest first.

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


# Events taken a little ahead by a thread: decoding on one core, classifying on another.

AHEAD = 32


@contextmanager
def read_ahead(events: Iterator[Event]) -> Iterator[Iterator[Event]]:
    """Yield the same events in the same order; the thread ends with the block."""
    reader = ThreadPoolExecutor(1, "afferents-ahead")

    def in_order() -> Iterator[Event]:
        taken = deque(reader.submit(next, events, None) for _ in range(AHEAD))
        while (event := taken.popleft().result()) is not None:
            taken.append(reader.submit(next, events, None))
            yield event

    try:
        yield in_order()
    finally:
        reader.shutdown(cancel_futures=True)


def _time_of(event: Event) -> float:
    return event.time_s


def in_order(
    sources: Iterable[Source], time_of: Callable[[Event], float] = _time_of
) -> Iterator[Event]:
    """Yield the events of recordings in the order of their times, each read a little ahead."""
    with ExitStack() as threads:
        events = [threads.enter_context(read_ahead(source.events())) for source in sources]
        yield from heapq.merge(*events, key=time_of)


# What is asked of sources before they are opened.

BOTH: frozenset[Channel] = frozenset({"video", "audio"})


@dataclass(frozen=True)
class Wanted:
    """What a camera and a microphone are to give.

    Attributes
    ----------
    channels
        Which are opened; others are not needed.
    sensor
        That the camera looks at; None where nobody has described it.
    fps_hz
        Frames a second; None for the camera's own.
    sample_rate_hz, n_channels
        Of the microphone.
    """

    channels: frozenset[Channel] = BOTH
    sensor: Sensor | None = None
    fps_hz: float | None = None
    sample_rate_hz: float = 44100.0
    n_channels: int = 1


def require_finite(offset_s: float) -> None:
    """Refuse an offset of the microphone's clock, s, that is no finite number.

    Raises
    ------
    InputError
        If it is not.
    """
    if not math.isfinite(offset_s):
        raise InputError(
            f"--audio-offset-ms: expected a number of ms, found {offset_s:g}; 'afferents align' "
            "measures it"
        )

"""Events of live sources (frames, sound, faults), and the mailbox, which drops the oldest.

Of running sources they are taken as they come, of recordings in the order of their times.
"""

import heapq
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame

Channel = Literal["video", "audio"]
BOTH: frozenset[Channel] = frozenset({"video", "audio"})
WAITING_FRAMES = 4
"""More frames than that are not kept waiting: a reader that is too slow skips the oldest."""
WAITING_SOUNDS = 100
AHEAD = 32
"""Events of a recording that are read ahead: decoding on one core, classifying on another."""


class CameraFrame(NamedTuple):
    """One camera frame.

    Attributes
    ----------
    frame
        As decoded; its time is the camera's, s.
    arrived_s
        When it lay decoded in memory, on this machine's monotonic clock, s.
    torn
        Whether the decoder reports that part of it is missing.
    channel
        Where it comes from.
    """

    frame: Frame
    arrived_s: float
    torn: bool = False
    channel: Channel = "video"

    @property
    def time_s(self) -> float:
        """When it was taken, on the camera's clock, s."""
        return self.frame.time_s


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
    channel
        Where they come from.
    """

    time_s: float
    samples: NDArray[np.float32]
    arrived_s: float
    channel: Channel = "audio"


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
        Frames or samples a second that it has, or that were requested where it states none.
    speed
        Seconds of its clock in a second: 1 for what happens now, so that events that are not
        taken in time are lost; infinite for a recording that waits to be taken.
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
def close_afterwards(sources: Iterable[Source]) -> Iterator[None]:
    """Close sources afterwards, whatever happens."""
    try:
        yield
    finally:
        for source in sources:
            source.close()


@dataclass(frozen=True)
class Wanted:
    """What a camera and a microphone are to give.

    Attributes
    ----------
    channels
        Which are opened; others are not needed.
    sensor
        That the camera looks at; None where there is no description of it.
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


def require_offset(offset_s: float) -> None:
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
                with self._changed:
                    same = [i for i, e in enumerate(self._events) if type(e) is type(event)]
                    most = WAITING_FRAMES if isinstance(event, CameraFrame) else WAITING_SOUNDS
                    if len(same) >= most:
                        del self._events[same[0]]
                    self._events.append(event)
                    self.last_s[event.channel] = time.monotonic()
                    self._changed.notify()
        except BaseException as error:  # noqa: BLE001  raised where the events are taken
            self._errors.append(error)
        with self._changed:
            self._open -= 1
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

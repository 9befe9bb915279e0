"""What sources give: pictures, sound, and what went wrong with them."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents.core.recording import Frame

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
        Frames or samples a second that it was asked for, or has.
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

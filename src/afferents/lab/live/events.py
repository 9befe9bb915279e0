"""What sources give: frames, sound, troubles and beginnings; and what they are to give."""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame

Channel = Literal["video", "audio"]
BOTH: frozenset[Channel] = frozenset({"video", "audio"})


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

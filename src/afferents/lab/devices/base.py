"""What a camera, a microphone and a drive are to a recording: one clock, nothing hidden.

All times are seconds of the monotonic clock (``time.monotonic()``), so that picture, sound
and drum can be laid on one another.
"""

import math
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from afferents.errors import AfferentsError, InputError, reason_of
from afferents.forms import StrictForm

FULL_SCALE = 32768.0
"""Of 16-bit samples, as wav files have them."""


class DeviceError(AfferentsError):
    """A device went away or no longer answers while it was in use: one sentence."""


def not_free(
    where: str, what: str, error: BaseException, do: str = "'afferents devices' lists what there is"
) -> InputError:
    """Return what to raise when a device can't be opened, and what to do about it."""
    return InputError(
        f"{where}: expected {what} that is plugged in and free, found "
        f"{reason_of(error).lower()}; {do}"
    )


class Frame(NamedTuple):
    """One buffer of a camera, as it came.

    Attributes
    ----------
    sequence
        The driver's number; gaps are lost frames.
    time_s
        Capture time by the driver, s on the monotonic clock.
    damaged
        The driver's error flag: the data may be torn.
    data
        As it came: a JPEG, or raw pixels in `CameraSettings.format`.
    """

    sequence: int
    time_s: float
    damaged: bool
    data: bytes


class Block(NamedTuple):
    """Some samples of a microphone.

    Attributes
    ----------
    time_s
        Capture time of the first sample, s on the monotonic clock.
    samples
        (n, channel).
    overflowed
        Samples were lost before this block.
    """

    time_s: float
    samples: NDArray[np.int16]
    overflowed: bool


class DriveState(NamedTuple):
    """Where the drum is and how fast it turns.

    Attributes
    ----------
    time_s
        When it was read, s on the monotonic clock.
    position_mm
        Way of the drum's surface since its index (or since the drive was opened), mm; None where
        nothing measures it.
    speed_mm_s
        Speed of the surface, mm/s; None where nothing measures it.
    fault
        What the drive complains of, or why its answer is impossible; None where all is well.
    """

    time_s: float
    position_mm: float | None
    speed_mm_s: float | None
    fault: str | None

    def raise_fault(self) -> None:
        """Raise `DeviceError` where there is a fault."""
        if self.fault is not None:
            raise DeviceError(f"the drive reports a fault: {self.fault}")


@dataclass(frozen=True)
class CameraSettings:
    """How a camera is set, all as read back from it.

    Attributes
    ----------
    name
        Its own name for itself.
    format
        ``MJPG``, ``GREY``, ``YUYV``...: four characters as V4L2 has them.
    width, height
        Size, px.
    fps_hz
        Frames a second that it reports; where it reports none, those requested, or NaN.
    controls
        Name of each control to its value, in the driver's units.
    unknown
        What this way of reading a camera can't report, a phrase each.
    """

    name: str
    format: str
    width: int
    height: int
    fps_hz: float
    controls: Mapping[str, float] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a rate that no camera has."""
        if self.fps_hz <= 0 or math.isinf(self.fps_hz):
            expected = "a rate above 0 frames/s"
            raise InputError(f"camera {self.name}: expected {expected}, found {self.fps_hz:g}")


@dataclass(frozen=True)
class MicrophoneSettings:
    """How a microphone is set, as read back.

    Attributes
    ----------
    name
        Its own name for itself.
    rate_hz
        Samples a second.
    channels
        Their number.
    """

    name: str
    rate_hz: float
    channels: int

    def __post_init__(self) -> None:
        """Refuse a rate and a number of channels that no microphone has."""
        if not 0 < self.rate_hz < math.inf or self.channels < 1:
            expected = "a rate above 0 Hz, one channel or more"
            found = f"{self.rate_hz:g} Hz, {self.channels} channels"
            raise InputError(f"microphone {self.name}: expected {expected}, found {found}")


FASTER = 2.0
"""No drum turns faster than this multiple of the highest speed of its drive. The times of readings,
each between question and answer, err by no larger factor."""
SLACK_S = 0.1
"""Way at that speed for which positions are coarse, and their times late, s."""
COMPARED_S = 0.5
"""Positions are compared where readings are no farther apart, s: a board may have restarted."""


@dataclass(frozen=True)
class DriveLimits:
    """Speeds that a drive can hold.

    Attributes
    ----------
    lowest_mm_s, highest_mm_s
        Of the drum's surface, mm/s.
    """

    lowest_mm_s: float
    highest_mm_s: float

    def find_impossible(self, state: DriveState, before: DriveState | None = None) -> str:
        """Return why a drive's answer is impossible; nothing where it is possible.

        Numbers must be finite, speeds and steps of the position within what the drum can do. An
        encoder that wraps and a single wrong reading are found by their step.

        Parameters
        ----------
        before
            The answer before; None for none.
        """
        for name, value in zip(("time", "position", "speed"), state[:3], strict=True):
            if value is not None and not math.isfinite(value):
                return f"its {name} is {value:g}"
        fastest_mm_s = FASTER * self.highest_mm_s
        if before and before.position_mm is not None and state.position_mm is not None:
            step_mm = state.position_mm - before.position_mm
            gone_s = abs(state.time_s - before.time_s)
            if gone_s <= COMPARED_S and abs(step_mm) > fastest_mm_s * (gone_s + SLACK_S):
                return f"its position went {step_mm:.0f} mm in {gone_s:.3f} s"
        if abs(state.speed_mm_s or 0.0) > fastest_mm_s:
            return f"its speed is {state.speed_mm_s:.0f} mm/s, its highest {self.highest_mm_s:g}"
        return ""


class Options(StrictForm):
    """Base of the options that a plan may give to a device of one kind: no unknown keys."""


class CameraOptions(Options):
    """Options that any camera has.

    Attributes
    ----------
    width, height
        Requested size, px; None for its own.
    fps_hz
        Requested frames a second; None for its own.
    """

    width: Annotated[int, Field(ge=16, le=8192)] | None = 640
    height: Annotated[int, Field(ge=16, le=8192)] | None = 480
    fps_hz: Annotated[float, Field(gt=0, le=2000)] | None = 90.0


class Device(ABC):
    """Something that is opened by ``with`` and let go at its end, whatever happens.

    It is made of its `Options` without being touched; `open` touches it.
    """

    Options: ClassVar[type[BaseModel]]

    @abstractmethod
    def open(self) -> None:
        """Open it and set it as its options say.

        Raises
        ------
        InputError
            If there is none, it is busy, or it can't be set so.
        """

    @abstractmethod
    def close(self) -> None:
        """Let it go; closing twice is no error."""

    def __enter__(self) -> Self:
        """Open it."""
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        """Let it go."""
        self.close()


class _Stream(Device):
    """Gives frames or blocks, in a thread of its own, until `end` is called.

    `_handle` is what `open` opened, which has a `close`; None while nothing is open.
    """

    kind: ClassVar[str]
    _handle: Any = None

    def __init__(self, options: Any) -> None:
        """Touch nothing yet."""
        self.options = options
        self._ended = threading.Event()

    def end(self) -> None:
        """Let it end soon; may be called from another thread. `close` it afterwards."""
        self._ended.set()

    def close(self) -> None:
        """Let it go."""
        self.end()
        handle, self._handle = self._handle, None
        if handle is not None:
            handle.close()

    def _begin(self) -> Any:
        """Return what is open, to be read until `end` is called from now on."""
        if self._handle is None:
            raise self._lost("it is not open")
        self._ended.clear()
        return self._handle

    def _lost(self, why: str) -> DeviceError:
        name = f"{self.kind} {self.options.device}"
        return DeviceError(f"{name}: lost ({why}); plug it in again")


class Camera(_Stream):
    """Gives frames as the driver gave them.

    Attributes
    ----------
    settings
        As read back; there once it is open.
    """

    kind = "camera"
    settings: CameraSettings

    @abstractmethod
    def frames(self) -> Iterator[Frame]:
        """Yield frames until `end` is called; sequence numbers begin anew with each call.

        Raises
        ------
        DeviceError
            When it is unplugged or gives no more frames.
        """


class Microphone(_Stream):
    """Gives blocks of sound.

    Attributes
    ----------
    settings
        As read back; there once it is open.
    """

    kind = "microphone"
    settings: MicrophoneSettings

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """Yield blocks from now on, until `end` is called.

        Raises
        ------
        DeviceError
            When it is unplugged or gives no more sound.
        """


class Drive(Device):
    """Turns the drum; `close` stops it first.

    A kind of drive defines `query`, which is judged by `read`.

    Attributes
    ----------
    limits
        Speeds that it can hold; there once it is open.
    """

    limits: DriveLimits
    _before: DriveState | None = None

    def require_speed(self, speed_mm_s: float) -> None:
        """Refuse a speed outside `limits`."""
        lowest, highest = self.limits.lowest_mm_s, self.limits.highest_mm_s
        if not lowest <= speed_mm_s <= highest:
            raise InputError(
                f"speed: expected {lowest:.3g} to {highest:g} mm/s, the drive's limits, found "
                f"{speed_mm_s:g} mm/s"
            )

    @abstractmethod
    def start(self, speed_mm_s: float) -> None:
        """Turn at this speed, mm/s, until another `start` or `stop`.

        Raises
        ------
        InputError
            If the speed is outside `limits`.
        DeviceError
            If the drive does not take it.
        """

    def read(self) -> DriveState:
        """Return where the drum is and how fast it turns.

        An impossible answer stops the drum, and is its `fault`; see `DriveLimits`.

        Raises
        ------
        DeviceError
            If the drive no longer answers.
        """
        state = self.query()
        before, self._before = self._before, state
        if why := self.limits.find_impossible(state, before):
            self.stop()
            return state._replace(fault=state.fault or f"impossible answer: {why}")
        return state

    @abstractmethod
    def query(self) -> DriveState:
        """Return what the drive answers, whatever it is.

        Raises
        ------
        DeviceError
            If the drive no longer answers.
        """

    @abstractmethod
    def stop(self) -> None:
        """Stop the drum; never raises. Called on any way out."""


WINDOW_S = 0.25
"""Speed is the slope of the positions of this time, s."""
LEAST_S = 0.02
"""In less time, s, the slope is that of single counts."""


class SpeedFromPosition:
    """The slope of the newest positions, by least squares."""

    def __init__(self) -> None:
        """Begin without positions."""
        self._seen: deque[tuple[float, float]] = deque()

    def read(self, time_s: float, position_mm: float) -> float:
        """Take in a position; return the speed, mm/s; 0 before `LEAST_S` are over."""
        self._seen.append((time_s, position_mm))
        while len(self._seen) > 2 and self._seen[1][0] <= time_s - WINDOW_S:
            self._seen.popleft()
        times, positions = np.array(self._seen).T
        if times[-1] - times[0] < LEAST_S:
            return 0.0
        times = times - times.mean()
        return float((times * positions).sum() / (times**2).sum())


class ByHandOptions(Options):
    """A drum that something else turns."""

    kind: Literal["none"] = "none"


class ByHand(Drive):
    """No drive: takes any speed, moves nothing, and knows nothing of the drum.

    The drum is turned by hand, or by another program.
    """

    Options = ByHandOptions

    def __init__(self, options: ByHandOptions | None = None) -> None:
        """Need nothing."""

    def open(self) -> None:
        """Open nothing."""
        self.limits = DriveLimits(0.0, float("inf"))

    def close(self) -> None:
        """Close nothing."""

    def start(self, speed_mm_s: float) -> None:
        """Do nothing: someone else turns the drum."""

    def query(self) -> DriveState:
        """Return the time, and that the rest is unknown."""
        return DriveState(time.monotonic(), None, None, None)

    def stop(self) -> None:
        """Stop nothing."""

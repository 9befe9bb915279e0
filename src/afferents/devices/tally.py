"""What became of the frames of a camera: counted from numbers, times and content."""

import hashlib
from dataclasses import dataclass

from afferents.devices.base import CameraSettings, Frame
from afferents.devices.picture import is_torn

LATE = 1.5
"""A frame that comes after more than so many times the usual interval, with none lost, is late."""


@dataclass
class Tally:
    """Counts frames as they come; the measured rate is that of their own times.

    Attributes
    ----------
    settings
        Of the camera.
    frames
        Frames that came.
    dropped
        Numbers that never came.
    repeated
        Frames whose number or whole content is that of the one before.
    late
        Frames that came after more than `LATE` intervals although none was dropped.
    damaged
        Frames that the driver flagged.
    torn
        Others that are cut short.
    """

    settings: CameraSettings
    frames: int = 0
    dropped: int = 0
    repeated: int = 0
    late: int = 0
    damaged: int = 0
    torn: int = 0

    def __post_init__(self) -> None:
        """Wait for the first frame."""
        self._first: Frame | None = None
        self._last: tuple[int, float, bytes] | None = None

    @property
    def rate_hz(self) -> float:
        """Frames a second by the camera's own numbers and times, lost ones included; NaN of one."""
        if self._first is None or self._last is None or self._last[1] <= self._first.time_s:
            return float("nan")
        return (self._last[0] - self._first.sequence) / (self._last[1] - self._first.time_s)

    def add(self, frame: Frame) -> None:
        """Count a frame."""
        digest = hashlib.blake2b(frame.data, digest_size=16).digest()
        self.frames += 1
        self.damaged += frame.damaged
        self.torn += not frame.damaged and is_torn(frame.data, self.settings)
        if self._last is not None:
            number, time_s, content = self._last
            self.dropped += max(0, frame.sequence - number - 1)
            self.repeated += frame.sequence <= number or digest == content
            gap = (frame.time_s - time_s) * self.settings.fps_hz
            self.late += frame.sequence == number + 1 and gap > LATE
        self._first = self._first or frame._replace(data=b"")
        self._last = (frame.sequence, frame.time_s, digest)

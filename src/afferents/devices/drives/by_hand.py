"""No drive: the drum is turned by hand, or by another program."""

import time
from typing import Literal

from afferents.devices.base import Drive, DriveLimits, DriveState, Options


class ByHandOptions(Options):
    """A drum that something else turns."""

    kind: Literal["none"] = "none"


class ByHand(Drive):
    """Takes any speed, moves nothing, and knows nothing of the drum: NaN."""

    Options = ByHandOptions

    def __init__(self, options: ByHandOptions | None = None) -> None:
        """Need nothing."""
        self.options = options or ByHandOptions()

    def open(self) -> None:
        """Open nothing."""
        self.limits = DriveLimits(0.0, float("inf"))

    def close(self) -> None:
        """Close nothing."""

    def start(self, speed_mm_s: float) -> None:
        """Leave it to whoever turns the drum."""

    def read(self) -> DriveState:
        """Return the time, and that the rest is unknown."""
        return DriveState(time.monotonic(), float("nan"), float("nan"), None)

    def stop(self) -> None:
        """Stop nothing."""

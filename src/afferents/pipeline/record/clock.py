"""The monotonic clock that a recording goes by; in a dry run it may go faster."""

import threading
import time


class Clock:
    """The monotonic clock.

    Parameters
    ----------
    speed
        How much faster than the machine's it goes; 1 for real devices.
    """

    def __init__(self, speed: float = 1.0) -> None:
        """Begin now."""
        self._begun_s, self._speed = time.monotonic(), speed

    def now(self) -> float:
        """Return the time, s."""
        real_s = time.monotonic()
        return (
            real_s if self._speed == 1 else self._begun_s + (real_s - self._begun_s) * self._speed
        )

    def wait(self, seconds: float, ended: threading.Event) -> bool:
        """Wait so long, or until something has ended; say whether it has."""
        return ended.wait(max(0.0, seconds) / self._speed)

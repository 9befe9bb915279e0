"""Speed: from positions, and held by a loop of ours where the drive does not."""

from collections import deque

import numpy as np

WINDOW_S = 0.25
"""Speed is the slope of the positions of so long."""


class SpeedFromPosition:
    """The slope of the newest positions, by least squares."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        """Know nothing yet."""
        self._window_s = window_s
        self._seen: deque[tuple[float, float]] = deque()

    def read(self, time_s: float, position_mm: float) -> float:
        """Take in a position; return the speed, mm/s; 0 of the first."""
        self._seen.append((time_s, position_mm))
        while len(self._seen) > 2 and self._seen[1][0] <= time_s - self._window_s:
            self._seen.popleft()
        times, positions = np.array(self._seen).T
        times = times - times.mean()
        spread = float((times**2).sum())
        return float((times * positions).sum() / spread) if spread > 0 else 0.0


class SpeedLoop:
    """Feed-forward, proportional and integral part; the output stays within -1 and 1.

    Parameters
    ----------
    duty_a_mm_s
        Duty that turns the drum at 1 mm/s, roughly.
    proportional
        Share of the error that is answered at once.
    integral_hz
        Share of the error that is answered in a second.
    """

    def __init__(
        self, duty_a_mm_s: float, proportional: float = 0.5, integral_hz: float = 5.0
    ) -> None:
        """Stand still."""
        self._duty_a_mm_s = duty_a_mm_s
        self._proportional, self._integral_hz = proportional, integral_hz
        self.aim(0.0)

    def aim(self, speed_mm_s: float) -> float:
        """Begin anew with another speed; return the duty to begin with."""
        self._aim_mm_s, self._sum_mm_s = speed_mm_s, 0.0
        self._last_s: float | None = None
        return self._duty(speed_mm_s)

    def step(self, time_s: float, speed_mm_s: float) -> float:
        """Return the duty from now on, by the speed that was measured."""
        error = self._aim_mm_s - speed_mm_s
        gone_s = 0.0 if self._last_s is None else min(time_s - self._last_s, 0.2)
        self._last_s = time_s
        summed = self._sum_mm_s + self._integral_hz * error * gone_s
        asked = self._aim_mm_s + self._proportional * error + summed
        if abs(asked * self._duty_a_mm_s) < 1:  # at its end it must not sum up further
            self._sum_mm_s = summed
        return self._duty(asked)

    def _duty(self, speed_mm_s: float) -> float:
        return float(np.clip(speed_mm_s * self._duty_a_mm_s, -1, 1))

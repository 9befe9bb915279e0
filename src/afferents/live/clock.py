"""Clocks of devices, read on this machine's monotonic clock.

A device's time runs at its own rate from its own zero. What it stamps arrives some time after; of
many arrivals the quickest was delayed least, so the least difference of arrival and stamp turns
one clock into the other, up to that least delay (exposure and transfer of a camera, a few ms).
Camera and microphone are both read on the monotonic clock, and so on one. What constant delay is
left between them is measured from a recording (`channels.offset`), and given to the stream.
"""

DRIFT = 1e-4
"""Clocks may drift apart by this much, s a second; the least difference is forgotten so fast."""


class HostClock:
    """Turns the times of one device into monotonic time."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._least_s: float | None = None
        self._at_s = 0.0

    def read(self, device_s: float, arrived_s: float) -> float:
        """Return when something was stamped, on the monotonic clock, s.

        Parameters
        ----------
        device_s
            Its stamp.
        arrived_s
            When it arrived, on the monotonic clock.
        """
        delay_s = arrived_s - device_s
        if self._least_s is not None:
            forgiven = self._least_s + DRIFT * (arrived_s - self._at_s)
            delay_s = min(delay_s, forgiven)
        self._least_s, self._at_s = delay_s, arrived_s
        return device_s + delay_s

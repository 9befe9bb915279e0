"""Clocks of devices, read on this machine's monotonic clock.

A device's time runs at its own rate from its own zero. What it stamps arrives some time after; of
many arrivals the quickest was delayed least, so the least difference of arrival and stamp turns
one clock into the other, up to that least delay (exposure and transfer of a camera, a few ms).
Camera and microphone are both read on the monotonic clock, and so on one. What constant delay is
left between them is measured from a recording (`extraction.align`), and given to the stream.
"""

DRIFT = 1e-4
"""Of quartz clocks, with a margin, s a second."""


class HostClock:
    """Turns the times of one device into monotonic time.

    Parameters
    ----------
    drift
        Clocks may drift apart by this much, s a second; the least difference is
        forgotten at this rate.
    """

    def __init__(self, drift: float = DRIFT) -> None:
        """Begin without stamps."""
        self._drift = drift
        self._least_s, self._at_s = float("inf"), 0.0

    def read(self, device_s: float, arrived_s: float) -> float:
        """Return when something was stamped, on the monotonic clock, s.

        Parameters
        ----------
        device_s
            Its stamp.
        arrived_s
            When it arrived, on the monotonic clock.
        """
        forgiven_s = self._least_s + self._drift * (arrived_s - self._at_s)
        self._least_s, self._at_s = min(arrived_s - device_s, forgiven_s), arrived_s
        return device_s + self._least_s


LOST_S = 0.2
"""A clock that is off by more than this from the count shows lost samples: PortAudio names most
losses itself, and the stamps of sound servers err by tens of ms."""
FOLLOW = 0.01
"""Share by which the count of samples follows the clock of the converter, a chunk."""


class SampleClock:
    """When samples were taken: counted at their rate, after the stamps of their chunks.

    Stamps err by some ms, those of a sound server by more; counted samples are regular.
    """

    def __init__(self, rate_hz: float) -> None:
        """Begin at the first chunk."""
        self._rate_hz = rate_hz
        self.next_s = 0.0
        self._taken_s: float | None = None

    def read(self, n: int, taken_s: float, lost: bool = False) -> float:
        """Return when the first of the next n samples was taken, s.

        Parameters
        ----------
        taken_s
            Their stamp.
        lost
            Whether samples were lost before them: the count begins anew.
        """
        first = self._taken_s is None or lost
        off_s = taken_s - self.next_s
        if self._taken_s is not None and taken_s <= self._taken_s:  # a converter without a clock
            off_s = 0.0
        self._taken_s = taken_s
        begin_s = taken_s if first or abs(off_s) >= LOST_S else self.next_s + FOLLOW * off_s
        self.next_s = begin_s + n / self._rate_hz
        return begin_s

"""What is known of vibration before it is encoded, for encodings to choose their options by."""

from typing import NamedTuple


class Known(NamedTuple):
    """A data set's vibration.

    Attributes
    ----------
    rate_hz
        Sample rate, Hz.
    shortest_s, longest_s
        Lengths of what the cut leaves of recordings, s.
    slowest_mm_s, fastest_mm_s
        Sliding speeds, mm/s.
    least_mm
        Way that was slid in the recording that slides the least, mm.
    n_channels
        Vibration channels.
    is_sound
        Whether samples are those of a sound file, without an offset.
    """

    rate_hz: float
    shortest_s: float
    longest_s: float
    slowest_mm_s: float
    fastest_mm_s: float
    least_mm: float
    n_channels: int
    is_sound: bool

    def samples_within(self, seconds: float) -> float:
        """Return a time that is a whole number of samples, and no longer than any recording, s."""
        return int(min(seconds, self.shortest_s) * self.rate_hz + 1e-6) / self.rate_hz

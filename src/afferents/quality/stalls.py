"""A camera that stalls and gives its picture again: frames that equal the one before to the bit.

Two frames of a camera that is alive never do, since its noise differs. That of a stalled one is
the same packet in MJPEG, and decodes to the same frame; other codecs say 'as before'. Genuine
skins that were encoded again at crf 35 had 2 equal frames in a row at most.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.quality.lasting import Times

FEWEST_AGAIN = 7
"""Equal frames in a row that are a stall. Fewer are frames that a converter wrote several times."""
STALL_S = 0.1
"""So long a stall lasts at least."""


class Stalls(NamedTuple):
    """How often a camera stalled.

    Attributes
    ----------
    spans
        From when to when, s: from a picture to the last that equals it.
    """

    spans: tuple[tuple[float, float], ...]

    @property
    def total_s(self) -> float:
        """How long in all, s."""
        return sum(end - begin for begin, end in self.spans)

    def within(self, part: tuple[float, float]) -> "Stalls":
        """Return what lies between two times, s."""
        cut = ((max(begin, part[0]), min(end, part[1])) for begin, end in self.spans)
        return Stalls(tuple(span for span in cut if span[1] > span[0]))

    def cover(self, time_s: Times) -> NDArray[np.bool_]:
        """Return which frames lie in one, (n_frames,)."""
        covered = np.zeros(len(time_s), bool)
        for begin, end in self.spans:
            covered |= (time_s > begin) & (time_s <= end)
        return covered

    def __str__(self) -> str:
        """Say it."""
        if not self.spans:
            return "never"
        begin, end = self.spans[0]
        if len(self.spans) == 1:
            return f"from {begin:.2f} s to {end:.2f} s"
        n = len(self.spans)
        return f"{n} times, {self.total_s:.2f} s in all, first from {begin:.2f} s to {end:.2f} s"


def find_stalls(equal: NDArray[np.bool_], time_s: Times) -> Stalls:
    """Find when a camera stalled.

    Parameters
    ----------
    equal, time_s
        Of each frame, (n_frames,): whether it equals the one before to the bit; its time.
    """
    edges = np.diff(np.r_[False, equal, False].astype(np.int8))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return Stalls(
        tuple(
            (float(time_s[max(begin - 1, 0)]), float(time_s[end]))
            for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
            if end - begin + 1 >= FEWEST_AGAIN
            and time_s[end] - time_s[max(begin - 1, 0)] >= STALL_S
        )
    )

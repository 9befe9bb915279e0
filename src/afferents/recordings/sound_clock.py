"""When a microphone's samples were taken, from the times of all its blocks.

A sound card stamps each block to within a millisecond. A sound server hands blocks on in heaps,
and its stamps err by tens of milliseconds, the first most of all. Samples are regular all the
same: so a straight line is laid through the times of many blocks, which a few wrong ones do not
move.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import siegelslopes

from afferents.recordings.run_log import BlockRow

_POINTS = 60
"""The median of as many blocks as make this many points; the line is laid through these."""
_DRIFT_FROM_S = 10.0
"""In less a drift can't be told from scatter: a line over 2 s would put its start off."""
_SD = 1.4826
"""Standard deviations of normal errors in their median absolute one."""
SURE = 4.0
"""Standard errors that a drift may lie beyond the limit: a busy machine delays what arrives."""
LIMIT_FRAMES = 0.5
"""Sound and picture may go apart by so much within a run, in frames."""


class Drift(NamedTuple):
    """How much faster a clock goes than this machine's, and its standard error, as shares."""

    share: float
    error: float

    def describe(self) -> str:
        """Return it in words."""
        return f"{1e6 * self.share:+.0f} ppm (error {1e6 * self.error:.0f})"


class SoundClock(NamedTuple):
    """When sound was taken.

    Attributes
    ----------
    start_s
        When its first sample was, on the monotonic clock.
    error_s
        Standard error of that. What delays all blocks alike is not in it.
    drift
        How much faster the samples come than their rate says; None if they are too few to say.
    """

    start_s: float
    error_s: float
    drift: Drift | None


def sound_clock(blocks: Sequence[BlockRow], rate_hz: float) -> SoundClock:
    """Lay a straight line through the times of blocks, up to the first before which some are lost.

    The slope is the median of medians of slopes between points (Siegel 1982), the start the median
    of what is left, so that up to half of the points may be anywhere.

    Parameters
    ----------
    blocks
        One or more, in order.
    rate_hz
        Of the samples.
    """
    whole = next((n for n, b in enumerate(blocks) if n and b.overflowed), len(blocks))
    parts = np.array_split(np.arange(whole), min(whole, _POINTS))
    counted = np.array([block.first_sample for block in blocks[:whole]]) / rate_hz
    late = np.array([block.time_s for block in blocks[:whole]]) - counted
    x = np.array([np.median(counted[part]) for part in parts])
    y = np.array([np.median(late[part]) for part in parts])
    slope = 0.0
    tells_drift = bool(counted[-1] - counted[0] >= _DRIFT_FROM_S and len(x) > 2)
    if tells_drift:
        slope = float(siegelslopes(y, x)[0])
    rest = y - slope * x
    start_s = float(np.median(rest))
    scatter = _SD * float(np.median(np.abs(rest - start_s)))
    spread = float(((x - x.mean()) ** 2).sum())
    if not tells_drift:
        return SoundClock(start_s, scatter / len(x) ** 0.5, None)
    error_s = scatter * float(np.sqrt(1 / len(x) + x.mean() ** 2 / spread))
    return SoundClock(start_s, error_s, Drift(-slope, scatter / spread**0.5))

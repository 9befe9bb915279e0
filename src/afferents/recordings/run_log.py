"""What is noted of a run while it is recorded, and what it says of the devices' clocks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import siegelslopes

from afferents.store.drum_path import DRIVE, Drum
from afferents.store.log import write_log

# Times are those of the monotonic clock, s. A run's own time, that of its video and its sound,
# counts from ``origin_s``, which stands above the columns of every log: when the first sample was
# taken, or without sound the first frame.

FRAMES, SOUND = "frames.csv", "sound.csv"


class FrameRow(NamedTuple):
    """A frame.

    Attributes
    ----------
    sequence
        The driver's number.
    time_s
        Capture.
    written_s
        When it was handed to the file.
    damaged
        The driver's error flag, or data that are cut short.
    repeated
        Says again what the one before said, byte for byte.
    stored
        Whether it is in the video; damaged ones lie in ``damaged/``.
    """

    sequence: int
    time_s: float
    written_s: float
    damaged: bool
    repeated: bool
    stored: bool


class BlockRow(NamedTuple):
    """A block of sound.

    Attributes
    ----------
    time_s
        Capture of its first sample.
    first_sample, n_samples
        Which sample of the file that is, and how many there are.
    overflowed
        Samples were lost before it.
    """

    time_s: float
    first_sample: int
    n_samples: int
    overflowed: bool


class DriveRow(NamedTuple):
    """What the drive answered, and the speed that it was given.

    NaN is what nothing measures; where an answer is impossible, `fault` says why.
    """

    time_s: float
    position_mm: float
    speed_mm_s: float
    set_mm_s: float
    fault: str | None


@dataclass
class Log:
    """What is noted of a run; each list is appended to by one thread.

    Attributes
    ----------
    origin_s
        When the run began.
    peak, clipped
        Largest value of the sensor's sound, of 32768, and samples at full scale.
    drum
        Which drum it is and where its positions count from; None where nobody knows.
    rest, last
        A frame at rest and the last one, as they came.
    """

    origin_s: float | None = None
    frames: list[FrameRow] = field(default_factory=list)
    blocks: list[BlockRow] = field(default_factory=list)
    drive: list[DriveRow] = field(default_factory=list)
    peak: int = 0
    clipped: int = 0
    drum: Drum | None = None
    rest: bytes = b""
    last: bytes = b""

    def write(self, folder: Path) -> None:
        """Write a log of each that there is."""
        for name, form, rows, drum in (
            (FRAMES, FrameRow, self.frames, None),
            (SOUND, BlockRow, self.blocks, None),
            (DRIVE, DriveRow, self.drive, self.drum),
        ):
            if rows:
                write_log(folder / name, form._fields, rows, self.origin_s, drum)


# When a microphone's samples were taken, from the times of all its blocks.
#
# A sound card stamps each block to within a millisecond. A sound server hands blocks on in heaps,
# and its stamps err by tens of milliseconds, the first most of all. Samples are regular all the
# same: so a straight line is laid through the times of many blocks, which a few wrong ones do not
# move.

_POINTS = 60
"""The median of as many blocks as make so many points; the line is laid through these."""
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

    def said(self) -> str:
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

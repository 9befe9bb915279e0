"""What is noted of a run while it is recorded.

Times are those of the monotonic clock, s. A run's own time, that of its video and its sound, counts
from ``origin_s``, which stands above the columns of every log: when the first sample was taken, or
without sound the first frame.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from afferents.store import drum_path, log

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
        The same as the one before, byte for byte.
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
        Which drum it is and where its positions count from; None where that is not known.
    rest, last
        A frame at rest and the last one, as they came.
    """

    origin_s: float | None = None
    frames: list[FrameRow] = field(default_factory=list)
    blocks: list[BlockRow] = field(default_factory=list)
    drive: list[DriveRow] = field(default_factory=list)
    peak: int = 0
    clipped: int = 0
    drum: drum_path.Drum | None = None
    rest: bytes = b""
    last: bytes = b""

    def write(self, folder: Path) -> None:
        """Write a log of each that there is."""
        for name, form, rows, drum in (
            (FRAMES, FrameRow, self.frames, None),
            (SOUND, BlockRow, self.blocks, None),
            (drum_path.DRIVE, DriveRow, self.drive, self.drum),
        ):
            if rows:
                log.write_log(folder / name, form._fields, rows, self.origin_s, drum)

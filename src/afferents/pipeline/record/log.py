"""What is noted of a run while it is made, and its tables on disk.

Times are those of the monotonic clock, s. A run's own time, that of its video and its sound,
counts from ``origin_s``, which every table has in its metadata: when the first sample was taken,
or without sound the first frame.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from afferents.core.drum import DRIVE, ORIGIN, Drum, write_drive

FRAMES, SOUND = "frames.parquet", "sound.parquet"


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
    """What the drive said, and the speed that it was asked for."""

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
        """Write the tables of what there is."""
        for name, form, rows in (
            (FRAMES, FrameRow, self.frames),
            (SOUND, BlockRow, self.blocks),
        ):
            if rows:
                table = _table(form, rows).replace_schema_metadata(
                    {ORIGIN: repr(self.origin_s).encode()}
                )
                pq.write_table(table, folder / name, compression="zstd")
        if self.drive:
            write_drive(folder / DRIVE, _table(DriveRow, self.drive), self.origin_s, self.drum)


_TYPES = {int: pa.int64(), float: pa.float64(), bool: pa.bool_(), str | None: pa.string()}


def _table(form: type, rows: Iterable[tuple[object, ...]]) -> pa.Table:
    types = form.__annotations__
    schema = pa.schema([(name, _TYPES[kind]) for name, kind in types.items()])
    columns = [list(column) for column in zip(*rows, strict=True)]
    return pa.Table.from_arrays(
        [pa.array(c, t.type) for c, t in zip(columns, schema, strict=True)], schema=schema
    )

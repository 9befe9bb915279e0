"""A log that another program writes, such as that of an arm, read as it grows; it moves nothing."""

import math
import time
from pathlib import Path
from typing import BinaryIO, Literal

from afferents.errors import InputError, reading
from afferents.lab.devices import base

TIMES = ("time_s", "timestamp")
POSITION, POSE, SPEED = (
    ("position_mm",),
    tuple(f"actual_TCP_pose_{n}" for n in range(3)),
    ("speed_mm_s",),
)
"""Columns that say how far the fingertip has come: the first that are there. Of poses (m) the path
counts, and speeds are added up."""
WAIT_S = 2.0
"""The next row comes within this time."""


class GrowingLogOptions(base.Options):
    """A CSV that grows: `path`, with names of columns in its first line."""

    kind: Literal["csv"] = "csv"
    path: Path


class GrowingLog(base.ByHand):
    """Says how far an arm is that another program moves, from the newest whole row of its log.

    The log's clock is set against the machine's by the rows that came soonest after their times: a
    delay that all rows share can't be known.
    """

    Options = GrowingLogOptions  # type: ignore[assignment]
    _file: BinaryIO | None = None

    def __init__(self, options: GrowingLogOptions) -> None:
        """Touch nothing yet."""
        self.options = options

    def open(self) -> None:
        """Open the log and wait for a row that is new.

        Raises
        ------
        InputError
            If it is not there, or lacks a column.
        DeviceError
            If it does not grow.
        """
        super().open()
        path, self._row = self.options.path, list[float]()
        self._way_mm, self._ahead_s, self._measured = 0.0, -math.inf, base.SpeedFromPosition()
        self._state = base.DriveState(-math.inf, None, None, None)
        with reading(path, "a log that another program writes", OSError, do="start that first"):
            self._file = path.open("rb")
            head = self._file.readline().decode("utf-8-sig", "replace")
            self._half = self._file.read().rpartition(b"\n")[2]  # when these came is unknown
        names = [name.strip(' "\r\n') for name in head.split(",")]
        clock = next((name for name in TIMES if name in names), None)
        self._columns = next((c for c in (POSITION, POSE, SPEED) if {*c} <= {*names}), ())
        if clock is None or not self._columns:
            self.close()
            raise InputError(
                f"{path}: expected the columns time_s or timestamp, and position_mm, speed_mm_s or "
                f"actual_TCP_pose_0 to _2, found {', '.join(names)}; rename them"
            )
        self._places = [names.index(name) for name in (clock, *self._columns)]
        self._came_s = time.monotonic()
        while not self._row:
            self.query()
            time.sleep(0.005)

    def close(self) -> None:
        """Close the log."""
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def query(self) -> base.DriveState:
        """Return what the newest row says, on the machine's clock."""
        if self._file is None:
            raise self._lost("one that is not open")
        now_s, before = time.monotonic(), self._row
        *lines, self._half = (self._half + self._file.read()).split(b"\n")
        for line in filter(None, map(bytes.strip, lines)):
            self._take(line.decode("utf-8", "replace"), now_s)
        if self._row is not before:
            # Never back, where a row that comes sooner than all before sets the clock anew.
            time_s = max(self._row[0] - self._ahead_s, self._state.time_s)
            slope = abs(self._measured.read(time_s, self._way_mm))
            speed = self._row[1] if self._columns == SPEED else slope
            self._came_s, self._state = now_s, base.DriveState(time_s, self._way_mm, speed, None)
        elif now_s - self._came_s > WAIT_S:
            raise self._lost(f"no new row in {WAIT_S:g} s")
        return self._state

    def _take(self, line: str, now_s: float) -> None:
        """Take in a row that is there by now; of rows whose times don't rise the first."""
        cells, before = line.split(","), self._row
        try:
            row = [float(cells[place]) for place in self._places]
        except (ValueError, IndexError):
            raise self._lost(f"the row '{line}'") from None
        if before and row[0] <= before[0]:
            return
        self._row, self._ahead_s = row, max(self._ahead_s, row[0] - now_s)
        if self._columns == POSITION:
            self._way_mm = row[1]
        elif before and self._columns == POSE:
            self._way_mm += 1000 * math.dist(row[1:], before[1:])
        elif before:
            self._way_mm += (row[0] - before[0]) * (row[1] + before[1]) / 2

    def _lost(self, found: str) -> base.DeviceError:
        self.close()
        path = self.options.path
        return base.DeviceError(
            f"{path}: expected a log of numbers that grows, found {found}; check what writes it"
        )

"""Logs of a recording, in CSV: our own, and what something else logged meanwhile (force, pose).

Above the names of the columns of ours stands a line of JSON after ``#``, `Head`. Numbers are in
full. What something else logged has a clock of its own.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel

from afferents import dims, documents
from afferents.errors import InputError, reading
from afferents.files import write_aside

_DO = "bring it back as it was, remove it, or record or simulate again"


class Head(BaseModel):
    """Above a log's columns: when the recording began, on the clock of `time_s`, and how many rows.

    Of a drive's log also what is known of the drum.
    """

    origin_s: float | None
    rows: int
    drum: dict[str, Any] | None = None


def write_log(
    path: Path,
    columns: Sequence[str],
    rows: Iterable[Iterable[object]],
    origin_s: float | None,
    drum: BaseModel | None = None,
) -> None:
    """Write a log, whole or not at all; see `Head`.

    Raises
    ------
    InputError
        If the disk is full.
    """
    rows = list(rows)
    known = None if drum is None else drum.model_dump()
    head = Head(origin_s=origin_s, rows=len(rows), drum=known)
    with write_aside(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {head.model_dump_json()}\n")
        csv.writer(file, lineterminator="\n").writerows([columns, *rows])


def read_log(path: Path, columns: Mapping[str, type]) -> tuple[Head, pd.DataFrame] | None:
    """Read columns of a log, of these types.

    Returns
    -------
    tuple
        None if there is no such log.

    Raises
    ------
    InputError
        If it is not whole, a column is missing, or something else stands in one.
    """
    if not path.is_file():
        return None
    what = f"a log with {', '.join(columns)}"
    with reading(path, what, OSError, ValueError, do=_DO):
        with path.open(encoding="utf-8", newline="") as file:
            content = documents.parse_json(file.readline().removeprefix("#"), path, what, _DO)
            head = documents.as_form(content, Head, path, what, _DO)
            # Nothing but nan stands for a number that is not known.
            kinds = dict(columns)
            table = pd.read_csv(file, dtype=kinds, keep_default_na=False, na_values=["nan"])
        if not columns.keys() <= set(table):
            raise ValueError(f"the columns {', '.join(map(str, table))}")
        if not isinstance(table.index, pd.RangeIndex):  # the first column, read as names of rows
            raise ValueError("rows longer than the names of columns")
        if len(table) != head.rows:
            raise ValueError(f"{len(table)} of its {head.rows} rows")
    return head, table[list(columns)]


Values = NDArray[np.float64]

DRIFT = 1e-4
"""How fast two clocks may go apart: quartz is good to 50 ppm, and either may be off."""


class Lag(NamedTuple):
    """How far a clock is ahead of the images'.

    Attributes
    ----------
    seconds
        What the images' clock calls t, the other calls t + `seconds`.
    error_s
        Uncertainty where it was measured, s.
    explained
        Share of the variance of the skin's motion that the other's numbers explain under it.
    at_s
        When it was measured, by the images' clock.
    """

    seconds: float = 0.0
    error_s: float = 0.0
    explained: float = 1.0
    at_s: float | None = None


AHEAD_BY_NOTHING = Lag()


@dataclass(frozen=True)
class LoggedFile:
    """A CSV of numbers, read when needed.

    Attributes
    ----------
    name
        Of the variable in the store.
    path, time, columns
        The file, its column of times (s, by a clock of its own), and those that are kept.
    units
        Of the numbers, such as N.
    lag
        How far its clock is ahead of the images'.
    """

    name: str
    path: Path
    time: str
    columns: tuple[str, ...]
    units: str
    lag: Lag = AHEAD_BY_NOTHING

    def read(self) -> tuple[Values, Values]:
        """Return times by its own clock, (n,), s, and numbers, (n, column).

        Raises
        ------
        InputError
            If the file can't be read, lacks a column, or its times don't rise.
        """
        with reading(self.path, "a readable CSV file"):
            table = pd.read_csv(self.path, skipinitialspace=True)
        if missing := [name for name in (self.time, *self.columns) if name not in table]:
            raise InputError(
                f"{self.path}: expected the column '{missing[0]}', found "
                f"{', '.join(map(str, table))}; rename what is it, or take the file away"
            )
        numbers = table[[self.time, *self.columns]].apply(pd.to_numeric, errors="coerce").to_numpy()
        time_s, values = numbers[:, 0].astype(np.float64), numbers[:, 1:].astype(np.float64)
        wrong = np.flatnonzero(~(np.diff(time_s, prepend=-np.inf) > 0))
        if len(wrong) or len(time_s) < 2:
            row = int(wrong[0]) if len(wrong) else len(time_s)
            raise InputError(
                f"{self.path}: expected rows of times that rise (s), found another in row "
                f"{row + 2}; take the row out, or the file away"
            )
        return time_s, values

    def rate_hz(self) -> float:
        """Return how many rows it has a second, in the median; raises as `read` does."""
        return float(1 / np.median(np.diff(self.read()[0])))

    def variable(self, origin_s: float) -> xr.DataArray:
        """Return the numbers as a store keeps them, float32, on the recording's clock.

        Parameters
        ----------
        origin_s
            The recording's beginning by the images' clock, s.
        """
        time_s, values = self.read()
        clock, axis = f"{self.name}_time", f"{self.name}_axis"
        measured_s = origin_s if self.lag.at_s is None else self.lag.at_s
        drift_s = DRIFT * abs(origin_s - measured_s)  # from then on the clocks may have drifted
        return xr.DataArray(
            values.astype(np.float32),
            dims=(clock, axis),
            coords={clock: time_s - self.lag.seconds - origin_s, axis: list(self.columns)},
            attrs={
                dims.UNITS: self.units,
                "clock_ahead_s": self.lag.seconds,
                "clock_error_s": self.lag.error_s + drift_s,
            },
        )

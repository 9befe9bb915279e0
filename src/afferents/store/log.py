"""Logs of a recording: tables of what was noted while it was made, in CSV.

Above the names of the columns stands a line of JSON after ``#``, `Head`. Numbers are in full.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import BaseModel

from afferents.documents import as_form, parse_json
from afferents.errors import reading
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
            content = parse_json(file.readline().removeprefix("#"), path, what, _DO)
            head = as_form(content, Head, path, what, _DO)
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

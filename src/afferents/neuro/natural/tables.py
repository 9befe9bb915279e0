"""Tables with a row a spike as `Spikes`, and columns of whatever table holds trials."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents.errors import InputError, reading
from afferents.neuro.natural.description import (
    MM_S,
    SECONDS,
    Columns,
    NaturalFile,
    as_text,
    classes_of,
)
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes

_TRIAL = ["texture", "speed_mm_s", "repetition"]
_READERS: dict[str, Callable[[Path], pd.DataFrame]] = {
    ".csv": pd.read_csv,
    ".parquet": pd.read_parquet,
}


def spikes_of_table(file: Path, described: NaturalFile, description: Path) -> Spikes:
    """Return the spikes of a CSV or Parquet table.

    A row is a spike. A row without a time says that the fibre was recorded in a trial and may have
    been silent; a fibre and trial without any row were not recorded together.

    Raises
    ------
    InputError
        See `read_natural`.
    """
    table = _table(file, described)
    fibres = table[["fibre", "class"]].drop_duplicates().sort_values("fibre")
    if fibres["fibre"].duplicated().any():
        column = described.columns.fibre_class
        raise InputError(f"{file}: expected one class a fibre in '{column}', found several of one")
    classes = classes_of(fibres["class"], described.fibres.words, description)
    units = pd.DataFrame({"name": fibres["fibre"].to_numpy(), "class": classes})
    of_trial = table.groupby(_TRIAL, dropna=False)
    trials = of_trial["duration_s"].max().reset_index()
    if described.spikes.unsorted == "sort":
        table = table.sort_values("time_s")
    times = {
        key: one.dropna().to_numpy(np.float64)
        for key, one in table["time_s"].groupby([of_trial.ngroup(), table["fibre"]])
    }
    rows = [[times.get((trial, name)) for name in units["name"]] for trial in trials.index]
    return Spikes.from_trains(rows, units, trials, file)


def _table(file: Path, described: NaturalFile) -> pd.DataFrame:
    """Return the table with the columns that this package calls them by."""
    if file.suffix.lower() == ".parquet":
        import_extra("parquet", str(file), "pyarrow")
    with reading(file, "a table that can be read"):
        read = _READERS[file.suffix.lower()](file.absolute())
    columns, duration_s = described.columns, described.trials.duration_s
    if not isinstance(duration_s, float | str):
        there = "nothing" if duration_s is None else "a list"
        raise InputError(
            f"{file}: expected how long trials last, found {there}; write duration_s in [trials]: "
            "a number, or the name of a column"
        )
    texts = {"fibre": columns.fibre, "class": columns.fibre_class, "texture": columns.texture}
    found = {name: column_of(read, own, file).map(as_text) for name, own in texts.items()}
    found["time_s"] = numbers_of(read, columns.time, file) * SECONDS[described.spikes.unit]
    table = pd.DataFrame(found).assign(speed_mm_s=speeds_of(read, described, file), repetition=0)
    if columns.repetition in read:
        table["repetition"] = numbers_of(read, columns.repetition, file)
    _require_one_trial(table, read.drop(columns=[*dict(columns).values()], errors="ignore"), file)
    in_column = isinstance(duration_s, str)
    return table.assign(
        duration_s=numbers_of(read, str(duration_s), file) if in_column else duration_s
    )


def _require_one_trial(table: pd.DataFrame, others: pd.DataFrame, file: Path) -> None:
    """Refuse trials that only other columns tell apart: their spikes would be taken for one's."""
    trial = [table[name] for name in ("fibre", *_TRIAL)]
    several = others.groupby(trial, dropna=False).nunique(dropna=False).max() > 1
    if several.any():
        raise InputError(
            f"{file}: expected one trial a fibre, texture, speed and repetition, found several "
            f"'{several.idxmax()}' in one; number repetitions in a column, or remove this one"
        )


def speeds_of(table: pd.DataFrame, described: NaturalFile, file: Path) -> pd.Series | float:
    """Return the speeds of trials, mm/s: of a column, one for all, or NaN if nobody knows them.

    Raises
    ------
    InputError
        If there is no such column, or no numbers in it.
    """
    trials = described.trials
    if trials.speed_unknown:
        return np.nan
    if isinstance(trials.speeds_mm_s, float):
        return trials.speeds_mm_s
    if trials.speeds_mm_s:
        raise InputError(
            f"{file}: expected one number as speeds_mm_s in [trials], found {trials.speeds_mm_s}; "
            "name the column of speeds in [columns]"
        )
    do = ", or write speed_unknown = true in [trials] if nobody knows it"
    require_column(table.columns, described.columns.speed, file, do)
    return numbers_of(table, described.columns.speed, file) * MM_S[trials.speed_unit]


def require_column(names: Collection[Any], name: str, file: Path, otherwise: str = "") -> None:
    """Refuse a table without a column, and list those that are there."""
    if name not in names:
        key = next((key for key, usual in Columns() if usual == name), None)
        how = f' ({key} = "ITS NAME")' if key else ""
        raise InputError(
            f"{file}: expected a column '{name}', found columns {', '.join(map(str, names))}; name "
            f"the one that is meant in [columns]{how}{otherwise}"
        )


def column_of(table: pd.DataFrame, name: str, file: Path) -> pd.Series:
    """Return a column; an `InputError` lists those that are there if it is not."""
    require_column(table.columns, name, file)
    return table[name]


def numbers_of(table: pd.DataFrame, name: str, file: Path) -> pd.Series:
    """Return a column of numbers.

    Raises
    ------
    InputError
        If it is not there, or holds others.
    """
    try:
        return column_of(table, name, file).astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{file}: expected numbers in the column '{name}', found others") from None

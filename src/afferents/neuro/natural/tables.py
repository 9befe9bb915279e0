"""Tables with a row a spike as `Spikes`."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents.errors import InputError, reason_of, then
from afferents.neuro.natural.description import MM_S, SECONDS, NaturalFile, as_text, classes_of
from afferents.spikes.population import Spikes


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
    columns = described.columns
    fibres = table.drop_duplicates("fibre")[["fibre", "class"]].sort_values("fibre")
    classes = classes_of(fibres["class"], described.fibres.words, description)
    units = pd.DataFrame({"name": fibres["fibre"].to_numpy(), "class": classes})
    if len(set(zip(table["fibre"], table["class"], strict=True))) > len(units):
        raise InputError(
            f"{file}: expected one class a fibre in '{columns.fibre_class}', found several of one"
        )
    of_trial = ["texture", "speed_mm_s", "repetition"]
    trials = table.groupby(of_trial, dropna=False)["duration_s"].max().reset_index()
    groups = table.groupby([*of_trial, "fibre"], dropna=False)["time_s"]
    times = {key: one.dropna().to_numpy(np.float64) for key, one in groups}
    known = {tuple(map(_key, key)): one for key, one in times.items()}
    rows = [
        [known.get((*map(_key, trial), name)) for name in units["name"]]
        for trial in trials[of_trial].itertuples(index=False)
    ]
    if described.spikes.unsorted == "sort":
        rows = [[None if one is None else np.sort(one) for one in row] for row in rows]
    return Spikes.from_trains(rows, units, trials, file)


def _key(value: Any) -> Any:
    """Return a value that equals itself: NaN does not."""
    return None if value != value else value


def _table(file: Path, described: NaturalFile) -> pd.DataFrame:
    """Return the table with the columns that this package calls them by."""
    read = _read(file)
    columns, trials = described.columns, described.trials
    found = pd.DataFrame(
        {
            "fibre": _column(read, columns.fibre, file).map(as_text),
            "class": _column(read, columns.fibre_class, file).map(as_text),
            "texture": _column(read, columns.texture, file).map(as_text),
            "time_s": _numbers(read, columns.time, file) * SECONDS[described.spikes.unit],
        }
    )
    if trials.speed_unknown:
        found["speed_mm_s"] = np.nan
    elif isinstance(trials.speeds_mm_s, float):
        found["speed_mm_s"] = trials.speeds_mm_s
    else:
        found["speed_mm_s"] = _numbers(read, columns.speed, file) * MM_S[trials.speed_unit]
    has_repetition = columns.repetition in read
    found["repetition"] = _numbers(read, columns.repetition, file) if has_repetition else 0
    if isinstance(trials.duration_s, float):
        found["duration_s"] = trials.duration_s
    elif isinstance(trials.duration_s, str):
        found["duration_s"] = _numbers(read, trials.duration_s, file)
    else:
        do = "add duration_s to [trials]: a number, or the name of a column"
        raise InputError(f"{file}: expected how long trials last, found nothing{then(do)}")
    return found


def _read(file: Path) -> pd.DataFrame:
    try:
        return pd.read_parquet(file) if file.suffix.lower() == ".parquet" else pd.read_csv(file)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"{file}: expected a table that can be read, found {reason_of(error)}"
        ) from error


def _column(table: pd.DataFrame, name: str, file: Path) -> pd.Series:
    if name not in table:
        found = f"columns {', '.join(map(str, table.columns))}"
        raise InputError(f"{file}: expected a column '{name}', found {found}; name it in [columns]")
    return table[name]


def _numbers(table: pd.DataFrame, name: str, file: Path) -> pd.Series:
    try:
        return _column(table, name, file).astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{file}: expected numbers in the column '{name}', found others") from None

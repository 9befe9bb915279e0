"""Tables with a row a spike, and NWB files, as `Spikes`: both hold fibres and trials in columns."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.documents import as_form
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
    columns, duration_s = described.columns, described.trials.duration_s
    texts = {"fibre": columns.fibre, "class": columns.fibre_class, "texture": columns.texture}
    with reading(file, "a table that can be read"):
        if file.suffix.lower() == ".parquet":
            read = pd.read_parquet(file.absolute())
        else:
            read = _read_csv(file.absolute(), texts.values())
    if not isinstance(duration_s, float | str):
        there = "nothing" if duration_s is None else "a list"
        raise InputError(
            f"{file}: expected how long trials last, found {there}; write duration_s in [trials]: "
            "a number, or the name of a column"
        )
    found = {name: _texts_of(read, own, file) for name, own in texts.items()}
    found["time_s"] = numbers_of(read, columns.time, file) * SECONDS[described.spikes.unit]
    speed = speeds_of(read, described, file)
    table = pd.DataFrame(found).assign(speed_mm_s=speed, repetition=0)
    if columns.repetition in read:
        table["repetition"] = numbers_of(read, columns.repetition, file)
    used = dict(columns)
    if not isinstance(speed, pd.Series):
        del used["speed"]  # which nobody took the speed from, but which tells trials apart
    _require_one_trial(table, read.drop(columns=[*used.values()], errors="ignore"), file)
    in_column = isinstance(duration_s, str)
    return table.assign(
        duration_s=numbers_of(read, str(duration_s), file) if in_column else duration_s
    )


def _read_csv(file: Path, texts: Collection[str]) -> pd.DataFrame:
    """Return a table; in its columns of texts, NA and the like are names."""
    table = pd.read_csv(file)
    there = [str(name) for name in table if name in texts]
    table[there] = pd.read_csv(file, usecols=there, keep_default_na=False, na_values=[""])[there]
    return table


def _texts_of(table: pd.DataFrame, name: str, file: Path) -> pd.Series:
    """Return a column of labels; refuse one in which some are missing."""
    column = column_of(table, name, file)
    if (missing := column.isna().to_numpy()).any():
        raise InputError(
            f"{file}: expected '{name}' of every row, found none in row {missing.argmax() + 1}; "
            "write it, or remove the row"
        )
    return column.map(as_text)


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
    with reading(file, f"numbers in the column '{name}'", TypeError, ValueError):
        return column_of(table, name, file).astype(np.float64)


# Units and trials of an NWB file.

_WITHIN_S = 1e-6
"""Times of a session are rounded: of a day in s, float64 keeps 1e-11."""
_TIMES = ("start_time", "stop_time")


def read_nwb(
    path: str | Path,
    texture: str = "texture",
    speed: str | None = "speed_mm_s",
    repetition: str = "repetition",
    fibre: str = "unit_name",
    fibre_class: str = "class",
    words: Mapping[str, Literal["SA", "RA", "PC"]] | None = None,
    speed_unit: Literal["mm/s", "cm/s", "m/s"] = "mm/s",
) -> Spikes:
    """Read units and trials of an NWB file, ours or anybody's, as natural afferents.

    Parameters
    ----------
    path
        An HDF5 file with units and trials; needs the extra ``nwb``.
    texture, speed, repetition
        Columns of the trials. Speed is None where nobody knows it. Without a column of
        repetitions, trials of one texture and speed are numbered.
    fibre, fibre_class
        Columns of the units. Without a column of names, their numbers are taken.
    words
        What classes in the file stand for, where that is not plain.
    speed_unit
        Of the column of speeds.

    Returns
    -------
    Spikes
        Times in the file are those of the session; here they count from the start of each trial. A
        unit counts as recorded in a trial that lies within one of its `obs_intervals`, or in all
        if it has none. Further columns of trials are kept as conditions.

    Raises
    ------
    InputError
        If the file can't be read, or has no units, trials or such columns, or an argument is not
        what it should be.
    """
    columns = {"texture": texture, "speed": speed or "", "repetition": repetition}
    given = {
        "file": str(path),
        "columns": {**columns, "fibre": fibre, "fibre_class": fibre_class},
        "fibres": {"words": dict(words or {})},
        "trials": {"speed_unit": speed_unit, "speed_unknown": speed is None},
    }
    described = as_form(given, NaturalFile, "read_nwb", "arguments")
    return spikes_of_nwb(Path(path), described, Path(path))


def spikes_of_nwb(file: Path, described: NaturalFile, description: Path) -> Spikes:
    """Return the spikes of an NWB file that a TOML file describes.

    Raises
    ------
    InputError
        See `read_natural`.
    """
    with reading(file, "an NWB file"):
        pynwb = import_extra("nwb", str(file), "pynwb")
        with pynwb.NWBHDF5IO(str(file), "r", load_namespaces=True) as io:
            content = io.read()
            for what in ("units", "trials"):
                if not getattr(content, what):
                    raise InputError(f"{file}: expected units and trials, found no {what}")
            trials = content.trials.to_dataframe()
            units = _units(content.units, described, file)
            found = [_unit(content.units, number, file) for number in range(len(units))]
    start, stop = (trials[name].to_numpy(np.float64) for name in _TIMES)
    rows = [
        [_cut(times, seen, first, last, start) for times, seen in found]
        for first, last in zip(start, stop, strict=True)
    ]
    return Spikes.from_trains(rows, units, _trials(trials, described, file), file)


def _units(units: Any, described: NaturalFile, path: Path) -> pd.DataFrame:
    if "spike_times" not in units.colnames:
        there = ", ".join(units.colnames)
        raise InputError(f"{path}: expected units with spike_times, found columns {there}")
    columns, words = described.columns, described.fibres.words
    require_column(units.colnames, columns.fibre_class, path)
    fibre = columns.fibre if "fibre" in columns.model_fields_set else "unit_name"
    names = units[fibre] if fibre in units.colnames else units.id
    classes = classes_of(units[columns.fibre_class][:], words, path)
    found = pd.DataFrame({"name": [as_text(one) for one in names[:]], "class": classes})
    if "resolution_s" in units.colnames:
        found["resolution_s"] = np.asarray(units["resolution_s"][:], np.float64)
    if "receptive_field" in units.colnames:
        fields = (np.asarray(units["receptive_field"][i]) for i in range(len(found)))
        found["receptive_field"] = [tuple(field.tolist()) for field in fields]
    return found


def _unit(
    units: Any, number: int, path: Path
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return a unit's times in the session, s, and when it was observed, `(interval, 2)`, s."""
    times = np.asarray(units.get_unit_spike_times(number), np.float64)
    if not (np.diff(times) >= 0).all():
        raise InputError(
            f"{path}: expected times in ascending order, found others in unit {number}"
        )
    if "obs_intervals" not in units.colnames:
        return times, None
    seen = np.asarray(units.get_unit_obs_intervals(number), np.float64).reshape(-1, 2)
    return times, seen


def _cut(
    times: NDArray[np.float64],
    seen: NDArray[np.float64] | None,
    first: float,
    last: float,
    starts: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """Return a unit's times in a trial; None where it was not observed all through it.

    A spike at the very end of a trial belongs to the next one where that starts there.
    """
    if seen is not None:
        whole = (seen[:, 0] <= first + _WITHIN_S) & (seen[:, 1] >= last - _WITHIN_S)
        if not whole.any():
            return None
    side: Literal["left", "right"] = "left" if np.any(starts == last) else "right"
    inside = slice(np.searchsorted(times, first), np.searchsorted(times, last, side))
    return np.clip(times[inside] - first, 0, last - first)


def _trials(trials: pd.DataFrame, described: NaturalFile, path: Path) -> pd.DataFrame:
    """Return the trials by the names of this package; further columns are conditions."""
    columns = described.columns
    found = pd.DataFrame({"texture": _texts_of(trials, columns.texture, path)})
    found["speed_mm_s"] = speeds_of(trials, described, path)
    if columns.repetition in trials:
        found["repetition"] = trials[columns.repetition]
    found["duration_s"] = trials["stop_time"] - trials["start_time"]
    taken = {*_TIMES, columns.texture, columns.speed, columns.repetition, *found, "timeseries"}
    return found.join(trials[[name for name in trials if name not in taken]])

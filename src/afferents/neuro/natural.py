"""Natural afferents as `Spikes`: recordings of nerve fibres in tables and NWB files."""

import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.errors import InputError, reading
from afferents.plugins import import_extra
from afferents.reporting.labels import shorten_list
from afferents.spikes.population import Spikes
from afferents.store.recording import fold_label, require_distinct

_LABELS = ("unit", "class", "texture")
_TRIAL = ["texture", "speed_mm_s", "repetition"]
_SECONDS = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6}
_NUMBERS = (*_SECONDS, "duration_s", "speed_mm_s", "repetition")
_MISSING = ("", "nan", "NaN", "NAN", "NA")
_MM_S = {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0}
_RENAME, _NAME_IT = "rename the one that is meant", "name the one that is meant in read_nwb"
_KNOWN = {
    "SA": ("sa", "sa1", "sai", "slowlyadapting"),
    "RA": ("ra", "ra1", "rai", "fa1", "fai", "qa", "rapidlyadapting"),
    "PC": ("pc", "ra2", "raii", "fa2", "faii", "pacinian"),
}
"""What classes are called in files, without blanks and signs."""
_WITHIN_S = 1e-6
"""Times of a session in an NWB file are rounded: of a day in s, float64 keeps 1e-11."""
_TIMES = ("start_time", "stop_time")


def read_spikes(path: str | Path, duration_s: float | None = None) -> Spikes:
    """Read recordings of natural afferents from a table or an NWB file.

    Parameters
    ----------
    path
        CSV or Parquet (extra ``parquet``) with a row a spike, or NWB with the columns that
        `read_nwb` expects. Columns of a table are `unit`, `class`, `texture`, `time_s` (or
        `time_ms`, `time_us`), `duration_s` and, if there are, `speed_mm_s` and `repetition`. A row
        without a time says that the fibre was recorded in a trial and may have been silent; a fibre
        and trial without any row were not recorded together.
    duration_s
        Of all trains of a table, in place of its column.

    Returns
    -------
    Spikes
        A unit a fibre; a trial a repetition of a texture at a speed. Fibres that were recorded one
        after another share trials, as if they had been recorded together.

    Raises
    ------
    InputError
        If the file can't be read, a column is missing or holds something else, trials differ in
        another column only, or times or durations can't be (as `Spikes.from_trains`).
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".nwb":
        return read_nwb(file)
    if suffix not in (".csv", ".parquet"):
        raise InputError(
            f"{file}: expected a table of spikes (.csv, .parquet) or an NWB file, found "
            f"'{file.name}'; other files become Spikes in Python (docs/neuroscience.md)"
        )
    table = _read_table(file, duration_s)
    fibres = table[["unit", "class"]].drop_duplicates().sort_values("unit")
    if fibres["unit"].duplicated().any():
        raise InputError(f"{file}: expected one class a fibre in 'class', found several of one")
    names = fibres["unit"].tolist()
    of_trial = table.groupby(_TRIAL, dropna=False)
    of_train = table.groupby([of_trial.ngroup(), "unit"])
    durations = of_train["duration_s"].agg(["min", "max"])
    if (durations["max"] > durations["min"]).any():
        raise InputError(
            f"{file}: expected one duration_s a fibre, texture, speed and repetition, found several"
        )
    lasting = durations["max"].to_dict()
    trains = {place: one.dropna().to_numpy() for place, one in of_train["time_s"]}
    places = [[(trial, name) for name in names] for trial in range(of_trial.ngroups)]
    return Spikes.from_trains(
        [[trains.get(place) for place in row] for row in places],
        {"name": names, "class": read_classes(fibres["class"], file)},
        of_trial.size().reset_index()[_TRIAL],
        file,
        [[lasting.get(place, np.nan) for place in row] for row in places],
    )


def _read_table(file: Path, duration_s: float | None) -> pd.DataFrame:
    """Return the table with labels as texts, times in s, durations, speeds and repetitions."""
    if file.suffix.lower() == ".parquet":
        import_extra("parquet", str(file), "pyarrow")
    with reading(file, "a table that can be read"):
        if file.suffix.lower() == ".parquet":
            table = pd.read_parquet(file.absolute())
        else:  # in labels, NA and the like are names
            table = pd.read_csv(
                file.absolute(), dtype=dict.fromkeys(_LABELS, str), skipinitialspace=True,
                keep_default_na=False,
                na_values=dict.fromkeys(_LABELS, "") | dict.fromkeys(_NUMBERS, _MISSING),
            )  # fmt: skip
    if duration_s is not None:
        table["duration_s"] = duration_s
    time = next((name for name in _SECONDS if name in table), "time_s")
    given = {name: _labels(table, name, file, _RENAME) for name in _LABELS}
    given["time_s"] = _numbers(table, time, file, _RENAME) * _SECONDS[time]
    given["duration_s"] = _numbers(table, "duration_s", file, "add it, or give duration_s")
    for name in {"speed_mm_s", "repetition"} & {*table}:
        given[name] = _numbers(table, name, file, _RENAME)
    found = pd.DataFrame({"speed_mm_s": np.nan, "repetition": 0} | given)
    # trials that differ in other columns only would be read as one
    others = table.drop(columns=[*_LABELS, *_NUMBERS], errors="ignore")
    train = [found[name] for name in ("unit", *_TRIAL)]
    several = others.groupby(train, dropna=False).nunique(dropna=False).max() > 1
    if several.any():
        raise InputError(
            f"{file}: expected one trial a fibre, texture, speed and repetition, found several "
            f"'{several.idxmax()}' in one; number repetitions in a column, or remove this one"
        )
    return found


def _require_column(names: Collection[Any], name: str, file: Path, do: str) -> None:
    """Refuse a table without a column, and list those that are there."""
    if name not in names:
        raise InputError(
            f"{file}: expected a column '{name}', found columns {', '.join(map(str, names))}; {do}"
        )


def _labels(table: pd.DataFrame, name: str, file: Path, do: str) -> pd.Series:
    """Return a column of labels; refuse one in which some are missing."""
    _require_column(table.columns, name, file, do)
    if (missing := table[name].isna().to_numpy()).any():
        raise InputError(
            f"{file}: expected '{name}' of every row, found none in row {missing.argmax() + 1}; "
            "write it, or remove the row"
        )
    labels = {label: fold_label(format_label(label)) for label in table[name].unique()}
    if name not in ("unit", "class"):  # one texture under two names would be two classes
        require_distinct(file, labels.values(), ())
    return table[name].map(labels)


def _numbers(table: pd.DataFrame, name: str, file: Path, do: str) -> pd.Series:
    """Return a column of numbers; refuse one that holds others."""
    _require_column(table.columns, name, file, do)
    with reading(file, f"numbers in the column '{name}'", TypeError, ValueError):
        return table[name].astype(np.float64)


def described_natural(spikes: Spikes) -> list[str]:
    """Return in sentences what natural recordings hold and what is missing.

    Returns
    -------
    Sentences on fibres, textures and speeds, fibres without any spike, and trials that were not
    recorded.
    """
    counts = spikes.units["class"].value_counts()
    of_class = ", ".join(f"{counts[name]} {name}" for name in ("SA", "RA", "PC") if name in counts)
    speeds = sorted(spikes.trials["speed_mm_s"].dropna().unique())
    at = f" at {', '.join(f'{v:g}' for v in speeds)} mm/s" if speeds else ", at unknown speeds"
    n_textures = spikes.trials["texture"].nunique()
    fibres = f"{spikes.n_units} fibre{'s' * (spikes.n_units != 1)} ({of_class})"
    found = [f"{fibres}, {n_textures} texture{'s' * (n_textures != 1)}{at}."]
    names, there = spikes.units.index.to_numpy(str), spikes.recorded.any(axis=0)
    fires = (spikes.counts() > 0).any(axis=0)
    if len(silent := names[there & ~fires].tolist()):
        found.append(f"Without any spike: {shorten_list(silent)}.")
    if len(absent := names[~there].tolist()):
        found.append(f"Never recorded: {shorten_list(absent)}.")
    if missing := int((~spikes.recorded).sum()):
        share = missing / spikes.recorded.size
        found.append(f"Not recorded: {missing} of {spikes.recorded.size} trains ({share:.0%}).")
    return found


def read_classes(
    names: Iterable[object], file: Path, words: Mapping[str, str] | None = None
) -> list[str]:
    """Return `SA`, `RA` or `PC` for each class as a file names it.

    Parameters
    ----------
    words
        The user's words, which go first.

    Raises
    ------
    InputError
        Naming the first that is not known.
    """
    known = {word: name for name, all_words in _KNOWN.items() for word in all_words}
    found = []
    for text in map(format_label, names):
        name = (words or {}).get(text) or known.get(re.sub(r"[\W_]", "", text).lower())
        if name is None:
            raise InputError(
                f"{file}: expected classes SA, RA or PC of fibres, found '{text}'; write in the "
                f"table which of them '{text}' is, or in read_nwb(..., words=)"
            )
        found.append(name)
    return found


def format_label(value: object) -> str:
    """Return a label as text: a whole number without a decimal point."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value.decode() if isinstance(value, bytes) else str(value)


def read_nwb(
    path: str | Path,
    texture: str = "texture",
    speed: str | None = "speed_mm_s",
    repetition: str = "repetition",
    fibre: str = "unit_name",
    fibre_class: str = "class",
    words: Mapping[str, str] | None = None,
    speed_unit: str = "mm/s",
) -> Spikes:
    """Read units and trials of an NWB file, ours or another laboratory's, as natural afferents.

    Parameters
    ----------
    path
        An HDF5 file with units and trials; needs the extra ``nwb``.
    texture, speed, repetition
        Columns of the trials. Speed is None where it is not known. Without a column of
        repetitions, trials of one texture and speed are numbered.
    fibre, fibre_class
        Columns of the units. Without a column of names, their numbers are taken.
    words
        ``SA``, ``RA`` or ``PC`` by the word in the file, where that is not one of the usual.
    speed_unit
        Of the column of speeds: ``mm/s``, ``cm/s`` or ``m/s``.

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
    file = Path(path)
    if speed_unit not in _MM_S:
        raise InputError(f"speed_unit: expected one of {', '.join(_MM_S)}, found '{speed_unit}'")
    with reading(file, "an NWB file"):
        pynwb = import_extra("nwb", str(file), "pynwb")
        with pynwb.NWBHDF5IO(str(file), "r", load_namespaces=True) as io:
            content = io.read()
            for what in ("units", "trials"):
                if not getattr(content, what):
                    raise InputError(f"{file}: expected units and trials, found no {what}")
            trials = content.trials.to_dataframe()
            units = _describe_units(content.units, fibre, fibre_class, words, file)
            start, stop = (trials[name].to_numpy(np.float64) for name in _TIMES)
            numbers = range(len(units))
            found = [_cut_trials(content.units, one, start, stop, file) for one in numbers]
    table = pd.DataFrame({"texture": _labels(trials, texture, file, _NAME_IT)})
    table["speed_mm_s"] = np.nan
    if speed is not None:
        do = f"{_NAME_IT}, or None as speed if it is not known"
        table["speed_mm_s"] = _numbers(trials, speed, file, do) * _MM_S[speed_unit]
    if repetition in trials:
        table["repetition"] = trials[repetition]
    table["duration_s"] = stop - start
    taken = {*_TIMES, texture, speed, repetition, *table, "timeseries"}
    conditions = trials[[name for name in trials if name not in taken]]
    return Spikes.from_trains(list(zip(*found, strict=True)), units, table.join(conditions), file)


def _describe_units(
    units: Any, fibre: str, fibre_class: str, words: Mapping[str, str] | None, path: Path
) -> pd.DataFrame:
    if "spike_times" not in units.colnames:
        there = ", ".join(units.colnames)
        raise InputError(f"{path}: expected units with spike_times, found columns {there}")
    _require_column(units.colnames, fibre_class, path, _NAME_IT)
    names = units[fibre] if fibre in units.colnames else units.id
    classes = read_classes(units[fibre_class][:], path, words)
    found = pd.DataFrame({"name": [format_label(one) for one in names[:]], "class": classes})
    if "resolution_s" in units.colnames:
        found["resolution_s"] = np.asarray(units["resolution_s"][:], np.float64)
    if "receptive_field" in units.colnames:
        fields = (np.asarray(units["receptive_field"][i]) for i in range(len(found)))
        found["receptive_field"] = [tuple(field.tolist()) for field in fields]
    return found


def _cut_trials(
    units: Any, number: int, start_s: NDArray[np.float64], stop_s: NDArray[np.float64], path: Path
) -> list[NDArray[np.float64] | None]:
    """Return a unit's times in each trial, s; None where it was not observed all through it.

    A spike at the very end of a trial belongs to the next one where that starts there.
    """
    times = np.asarray(units.get_unit_spike_times(number), np.float64)
    if not (np.diff(times) >= 0).all():
        raise InputError(
            f"{path}: expected times in ascending order, found others in unit {number}"
        )
    seen = np.array([[-np.inf, np.inf]])
    if "obs_intervals" in units.colnames:
        seen = np.asarray(units.get_unit_obs_intervals(number), np.float64).reshape(-1, 2)
    found: list[NDArray[np.float64] | None] = []
    for first, last in zip(start_s, stop_s, strict=True):
        whole = (seen[:, 0] <= first + _WITHIN_S) & (seen[:, 1] >= last - _WITHIN_S)
        end = np.searchsorted(times, last, "left" if np.any(start_s == last) else "right")
        inside = times[np.searchsorted(times, first) : end]
        found.append(np.clip(inside - first, 0, last - first) if whole.any() else None)
    return found

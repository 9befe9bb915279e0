"""Tables of numbers: what a `dataset.toml` says of them, and how files of each kind are read."""

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat, model_validator

from afferents.documents import as_form, read_toml
from afferents.errors import InputError, reading
from afferents.forms import StrictForm
from afferents.plugins import import_extra
from afferents.recordings.audio import WavFile, sound_name
from afferents.recordings.media import Pattern

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_MM = {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0, "mm/min": 1 / 60}
_MS = {"s": 1000.0, "ms": 1.0, "us": 1e-3, "ns": 1e-6}
_RESAMPLING = {"interpolation", "longest_gap_ms", "out_of_order"}
_OF_A_CLOCK = ("sample_rate_hz", "period_ms", "jitter_ms")


class Files(StrictForm):
    """Which files are recordings, and what their names say.

    Attributes
    ----------
    folders
        Where files are looked for, relative to the data set; the first with files that match.
        ``**`` is any folder.
    pattern
        Their path from there, such as ``{texture}/{speed}_{trial}.csv``: `texture` and `speed`,
        and conditions of any name; ``{*}`` is what is left alone. All else stands for itself. A
        path that can be read in two ways is refused.
    regex
        The same as a regular expression with named groups, for all of the path.
    texture, speed_mm_s
        Of all recordings, where names don't say. Without a speed, models that need none can be
        asked with ``--split trial``, or another condition.
    speed_unit, speed_scale
        Of the speed in names, and what the number there is multiplied with to be in that unit.
    words
        What texts in names stand for, by placeholder.
    """

    folders: tuple[str, ...] = Field(default=(".",), min_length=1)
    pattern: str = ""
    regex: str = ""
    texture: str = ""
    speed_mm_s: PositiveFloat | None = None
    speed_unit: Literal["mm/s", "cm/s", "m/s", "mm/min"] = "mm/s"
    speed_scale: PositiveFloat = 1.0
    words: dict[str, dict[str, str]] = Field(default_factory=dict)

    @property
    def names(self) -> Collection[str]:
        """What a path says."""
        if self.pattern:
            return Pattern(self.pattern).names
        return re.compile(self.regex).groupindex

    def values(self, path: str, where: Path) -> Mapping[str, str] | None:
        """Return what a path says by these names; None if it is no recording's.

        Parameters
        ----------
        where
            The description, for the error.

        Raises
        ------
        InputError
            If the pattern reads it in two ways.
        """
        if self.pattern:
            return Pattern(self.pattern, where).values(path)
        match = re.fullmatch(self.regex, path)
        return match.groupdict(default="") if match else None

    @property
    def depth(self) -> int:
        """Of how many names a path consists: as many as there are slashes, and one."""
        return re.sub(r"\[[^\]]*\]", "", self.regex).count("/") + self.pattern.count("/") + 1

    @property
    def mm_s(self) -> float:
        """What a speed in names of 1 is, mm/s."""
        return self.speed_scale * _MM[self.speed_unit]

    @model_validator(mode="after")
    def _says_what_is_needed(self) -> Self:
        if any(Path(folder).is_absolute() for folder in self.folders):
            raise ValueError("folders from that of the description on, such as ../data")
        if bool(self.pattern) == bool(self.regex):
            raise ValueError("either a pattern or a regex")
        try:
            names = self.names
        except re.error as error:
            raise ValueError(f"no pattern: {error}") from None
        except InputError as error:
            raise ValueError(str(error).partition(": expected ")[2]) from None
        if ("texture" in names) == bool(self.texture):
            raise ValueError("texture must be in the pattern, or texture be given, not both")
        if "speed" in names and self.speed_mm_s:
            raise ValueError("speed must be in the pattern, or speed_mm_s be given, not both")
        if unknown := sorted(set(self.words) - set(names)):
            raise ValueError(f"words of '{unknown[0]}', which is not in the pattern")
        return self


class Signal(StrictForm):
    """What is in a file.

    Attributes
    ----------
    format
        Of all files; by suffix if not given.
    channels
        Columns that are channels, by name (``taxel*`` for several) or number from 0; all but the
        time, if not given.
    columns
        All columns of a CSV in their order, where another header is to be refused.
    arrays
        Of NPZ and HDF5 files, those that are read; all if not given.
    header, separator
        Of a CSV: whether its first line names columns, and what stands between fields.
    sample_rate_hz, period_ms
        The clock, either as a rate or as its step.
    time, time_unit
        Column that says when each row was taken. Without a rate that of the first file is used.
        The rate is compared with the whole time of every file.
    jitter_ms
        By how much a step may differ from the clock's; half a step if not given.
    resample_hz
        Rate of a regular clock, Hz, that rows which come unevenly are brought to.
    interpolation
        Between such rows: straight lines, or Akima's cubic (modified, which hardly overshoots).
    longest_gap_ms
        Without a row that is bridged; five times the median step of a file if not given.
    out_of_order
        Share of a file's rows that may be dropped since they don't come after all before them.
    duplicates
        Whether a row that repeats the one before, time included, is refused or counts once.
    least_s
        Shorter recordings are refused.
    units
        Of the channels.
    steady_s
        Start and stop of constant speed in every file, s, or ``all``; a negative stop counts from
        the end. 2.5 s are cut off each end if not given.
    """

    format: Literal["csv", "parquet", "npy", "npz", "wav", "flac", "h5", "hdf5"] | None = None
    channels: tuple[str | int, ...] = ()
    columns: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    header: bool = True
    separator: Annotated[str, Field(min_length=1, max_length=1)] = ","
    sample_rate_hz: PositiveFloat | None = None
    period_ms: PositiveFloat | None = None
    time: str | int | None = None
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    jitter_ms: Annotated[float, Field(ge=0)] | None = None
    resample_hz: PositiveFloat | None = None
    interpolation: Literal["linear", "cubic"] = "linear"
    longest_gap_ms: PositiveFloat | None = None
    out_of_order: Annotated[float, Field(ge=0, lt=1)] = 0.01
    duplicates: Literal["refuse", "once"] = "refuse"
    least_s: Annotated[float, Field(ge=0)] = 0.0
    units: str = "counts"
    steady_s: Literal["all"] | tuple[Annotated[float, Field(ge=0)], float] | None = None

    @property
    def rate_hz(self) -> float | None:
        """The sample rate that is declared, or wanted, Hz."""
        if self.resample_hz is not None:
            return self.resample_hz
        return self.sample_rate_hz if self.period_ms is None else 1000 / self.period_ms

    @property
    def time_ms(self) -> float:
        """A unit of the time column in ms."""
        return _MS[self.time_unit]

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.sample_rate_hz and self.period_ms:
            raise ValueError("sample_rate_hz or period_ms, not both")
        lone = sorted(_RESAMPLING & self.model_fields_set)
        other = [name for name in _OF_A_CLOCK if getattr(self, name) is not None]
        if self.resample_hz is None and lone:
            raise ValueError(f"{lone[0]} goes with resample_hz")
        if self.resample_hz is not None and self.time is None:
            raise ValueError("resample_hz needs the time column")
        if self.duplicates == "once" and self.time is None:
            raise ValueError("duplicates = 'once' needs the time column")
        if self.resample_hz is not None and other:
            raise ValueError(f"resample_hz or {other[0]}, not both")
        if isinstance(self.steady_s, tuple) and self.steady_s[0] >= self.steady_s[1] >= 0:
            raise ValueError("steady_s must start before it stops")
        return self


class DataSetFile(StrictForm):
    """A `dataset.toml`.

    Attributes
    ----------
    title
        In sentences.
    simulated
        Stated in every report.
    encodings
        Options of encodings, by name; others are chosen to suit rate, lengths and speeds.
    """

    title: str = ""
    simulated: bool = False
    files: Files
    signal: Signal = Signal()
    encodings: dict[str, dict[str, Any]] = Field(default_factory=dict)


def read_data_set_file(path: Path) -> DataSetFile:
    """Read a `dataset.toml`.

    Raises
    ------
    InputError
        Naming the first key that is missing, unknown or wrong.
    """
    what = "the description of a data set"
    return as_form(read_toml(path, what), DataSetFile, path, what, "see docs/your-data.md")


# Tables of numbers in files: CSV, Parquet, NPY, NPZ, HDF5 and sound, read as columns.
#
# To add a format, write a function from a path and the `[signal]` of a `dataset.toml` to a `Table`,
# and name its suffix in `FORMATS`.

Numbers = NDArray[np.float64]


class Table(NamedTuple):
    """A table of numbers.

    Attributes
    ----------
    columns
        Their names; where a file has none, their numbers from 0.
    values
        (row, column), float64.
    place
        Where each row stands in the file, (row,): lines from 1, or rows from 0.
    unit
        What `place` counts: ``line`` or ``row``.
    rate_hz
        Sample rate that the file declares, None where it declares none.
    """

    columns: tuple[str, ...]
    values: Numbers
    place: NDArray[np.int64]
    unit: str = "row"
    rate_hz: float | None = None


def read_table(path: Path, signal: Signal) -> Table:
    """Read a file.

    Raises
    ------
    InputError
        If it can't be read, or does not hold a table of numbers; of a CSV it names the line.
    """
    suffix = signal.format or path.suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        known = f"a file of {', '.join(FORMATS)}"
        raise InputError(
            f"{path}: expected {known}, found '{path.suffix}'; say which in [signal] format"
        )
    with reading(path, f"a readable {suffix.upper()} file"):
        return FORMATS[suffix](path, signal)


def _require_different(path: Path, names: Sequence[str]) -> None:
    if twice := [name for name, n in Counter(names).items() if n > 1]:
        raise InputError(
            f"{path}: expected columns of different names, found '{twice[0]}' twice; rename one"
        )


def _csv(path: Path, signal: Signal) -> Table:
    text = path.read_text(encoding="utf-8-sig", errors="replace").rstrip()
    header, _, body = text.partition("\n") if signal.header else ("", "", text)
    first = 2 if signal.header else 1
    names = [name.strip() for name in header.split(signal.separator)]
    if not signal.header:
        n = len(body.partition("\n")[0].split(signal.separator))
        names = [str(number) for number in range(n)]
    _require_different(path, names)
    if signal.columns and names != list(signal.columns):
        expected = f"the columns {', '.join(signal.columns)}"
        raise InputError(f"{path}, line 1: expected {expected}, found {names}")
    if not body.strip():
        raise InputError(f"{path}: expected rows of data below the header, found none")
    values = _fast(body, names, signal)
    if values is None:
        raise _fault(path, body, names, signal, first)
    return Table(tuple(names), values, np.arange(len(values)) + first, "line")


def _fast(body: str, names: Sequence[str], signal: Signal) -> Numbers | None:
    """Return the numbers of a CSV without its header; None where something is at fault."""
    import pandas as pd

    try:
        frame = pd.read_csv(
            io.StringIO(body), sep=signal.separator, header=None, index_col=False,
            skip_blank_lines=False, dtype=np.float64, keep_default_na=False, na_values=[""],
            quoting=csv.QUOTE_NONE,
        )  # fmt: skip
    except ValueError:  # of pandas' parser as well
        return None
    values = np.asarray(frame.to_numpy(), np.float64)
    whole = values.shape[1] == len(names) and bool(np.isfinite(values).all())
    return values if whole else None


def _fault(path: Path, body: str, names: Sequence[str], signal: Signal, first: int) -> InputError:
    """Return what is wrong with the first line at fault."""
    for number, line in enumerate(body.split("\n"), start=first):
        fields = line.rstrip("\r").split(signal.separator)
        if len(fields) != len(names):
            return InputError(
                f"{path}, line {number}: expected {len(names)} fields, found {len(fields)}"
            )
        if wrong := [field.strip() for field in fields if not NUMBER.fullmatch(field.strip())]:
            return InputError(f"{path}, line {number}: expected numbers, found '{wrong[0]}'")
    return InputError(f"{path}: expected a table of numbers, found one that can't be read")


def _parquet(path: Path, signal: Signal) -> Table:
    import_extra("parquet", str(path), "pyarrow")
    import pandas as pd

    frame = pd.read_parquet(path.absolute(), columns=list(signal.arrays) or None)
    return _columns(path, {str(name): frame[name].to_numpy() for name in frame.columns})


def _numpy(path: Path, signal: Signal) -> Table:
    found = np.load(path, allow_pickle=False)
    if isinstance(found, np.ndarray):
        return _columns(path, _parts("", found))
    with found:
        wanted = _wanted(path, list(found), signal)
        return _columns(path, _joined(path, ((key, found[key]) for key in wanted)))


def _hdf5(path: Path, signal: Signal) -> Table:
    h5py = import_extra("hdf5", str(path), "h5py")
    with h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(lambda name, one: names.append(name) if hasattr(one, "shape") else None)
        wanted = _wanted(path, names, signal)
        return _columns(path, _joined(path, ((key, file[key][()]) for key in wanted)))


def _sound(path: Path, signal: Signal) -> Table:
    import soundfile

    samples, rate_hz = soundfile.read(sound_name(path), dtype="float64", always_2d=True)
    _ = WavFile(path, 0).header  # refuses one that was cut off
    table = _columns(path, _parts("", samples))
    return table._replace(rate_hz=float(rate_hz))


def _wanted(path: Path, there: Sequence[str], signal: Signal) -> Sequence[str]:
    """Return the arrays of a file that are read: those named, else all."""
    if missing := [key for key in signal.arrays if key not in there]:
        found = ", ".join(there) or "none"
        raise InputError(
            f"{path}: expected the array '{missing[0]}', found {found}; name it in [signal] arrays"
        )
    return signal.arrays or there


def _joined(path: Path, arrays: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    named = [(name, part) for key, array in arrays for name, part in _parts(key, array).items()]
    _require_different(path, [name for name, _ in named])
    return dict(named)


def _parts(key: str, array: Any) -> dict[str, Any]:
    """Return the columns of an array: one, or those of (row, column), numbered after its name."""
    array = np.asarray(array)
    if array.ndim == 2:
        return {f"{key}{number}": column for number, column in enumerate(array.T)}
    return {key or "0": array}


def _columns(path: Path, columns: dict[str, Any]) -> Table:
    """Return a table of columns that must be numbers and equally long."""
    for name, values in columns.items():
        if values.ndim != 1 or values.dtype.kind not in "iuf":
            found = f"{values.ndim} dims of {values.dtype} in '{name}'"
            expected = "columns of numbers"
            raise InputError(
                f"{path}: expected {expected}, found {found}; name those to read in [signal] arrays"
            )
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1:
        expected = "columns of one length"
        found = ", ".join(f"{name} of {n}" for name, n in lengths.items()) or "none"
        raise InputError(
            f"{path}: expected {expected}, found {found}; name those to read in [signal] arrays"
        )
    values = np.stack([np.asarray(v, np.float64) for v in columns.values()], axis=1)
    if not len(values):
        raise InputError(f"{path}: expected rows of data, found none")
    return Table(tuple(columns), values, np.arange(len(values)))


Reader = Callable[[Path, Signal], Table]
FORMATS: dict[str, Reader] = {
    "csv": _csv,
    "parquet": _parquet,
    "npy": _numpy,
    "npz": _numpy,
    "wav": _sound,
    "flac": _sound,
    "h5": _hdf5,
    "hdf5": _hdf5,
}
"""By suffix."""

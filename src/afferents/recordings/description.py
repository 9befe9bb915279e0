"""What a `dataset.toml` states of a data set: its files, their names and labels, its signal."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from afferents import documents, forms
from afferents.errors import InputError
from afferents.recordings.pattern import Pattern

_MM = {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0, "mm/min": 1 / 60}
UNITS_MS = {"s": 1000.0, "ms": 1.0, "us": 1e-3, "ns": 1e-6}
_Rate = Annotated[float, Field(ge=1, le=1e7)]
_RESAMPLING = {"interpolation", "longest_gap_ms", "out_of_order"}
_OF_A_CLOCK = ("sample_rate_hz", "period_ms", "jitter_ms")


class Labels(forms.StrictForm):
    """A file that says what files of data hold, a row each: a CSV, or JSON.

    JSON is a list of objects, or an object by file, of objects or of textures alone.

    Attributes
    ----------
    file
        Its path from the description on.
    name
        Column, or key, of the data's file: a path as `Files` looks for it, with or without its
        ending.
    texture, speed
        Columns of texture and speed; empty where names of files say them.
    conditions
        Columns that are conditions.
    """

    file: str = Field(min_length=1)
    name: str = "file"
    texture: str = "texture"
    speed: str = ""
    conditions: tuple[str, ...] = ()

    @property
    def columns(self) -> Mapping[str, str]:
        """The column of each thing that it says, by what that is: texture, speed, a condition."""
        columns = {"texture": self.texture, "speed": self.speed, **{c: c for c in self.conditions}}
        return {name: column for name, column in columns.items() if column}


class Files(forms.StrictForm):
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
        tested with ``--split trial``, or another condition.
    speed_unit, speed_scale
        Of the speed in names, and what the number there is multiplied with to be in that unit.
    words
        What texts in names stand for, by placeholder.
    labels
        A file next to them that says what names don't.
    joined
        Placeholder whose values name the files of one recording, such as ``axis`` of x, y and z:
        files that differ in nothing else are read side by side.
    """

    folders: tuple[str, ...] = Field(default=(".",), min_length=1)
    pattern: str = ""
    regex: str = ""
    texture: str = ""
    speed_mm_s: PositiveFloat | None = None
    speed_unit: Literal["mm/s", "cm/s", "m/s", "mm/min"] = "mm/s"
    speed_scale: PositiveFloat = 1.0
    words: dict[str, dict[str, str]] = Field(default_factory=dict)
    labels: Labels | None = None
    joined: str = ""

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
        labelled = set() if self.labels is None else set(self.labels.columns)
        if twice := sorted(labelled & set(names)):
            raise ValueError(f"{twice[0]} must be in the pattern or in labels, not both")
        stated = labelled | set(names)
        if ("texture" in stated) == bool(self.texture):
            raise ValueError(
                "texture must be in the pattern or in labels, or texture be given, not both"
            )
        if "speed" in stated and self.speed_mm_s:
            raise ValueError(
                "speed must be in the pattern or in labels, or speed_mm_s be given, not both"
            )
        if self.joined and self.joined not in names:
            raise ValueError(f"joined names '{self.joined}', which is not in the pattern")
        if unknown := sorted(set(self.words) - stated):
            raise ValueError(f"words of '{unknown[0]}', which is not in the pattern")
        return self


class Signal(forms.StrictForm):
    """What is in a file.

    Attributes
    ----------
    format
        Of all files; by suffix if not given.
    channels
        Columns that are channels, by name (``taxel*`` for several) or number from 0; all but the
        time, if not given. What stands in other columns is not looked at.
    packed
        In place of `channels`: for each channel the columns that hold its samples one after the
        other, ``pac*`` for the 22 of a row. Rates and times are then those of samples.
    columns
        All columns of a CSV in their order, where another header is to be refused.
    arrays
        Of NPZ, HDF5 and MATLAB files, those that are read; all if not given. ``trial/pac0`` is a
        dataset in a group, or a field of a struct.
    header, separator, decimal
        Of a CSV: whether its first line names columns, what stands between fields, and in numbers.
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

    format: Literal["csv", "parquet", "npy", "npz", "wav", "flac", "h5", "hdf5", "mat"] | None = (
        None
    )
    channels: tuple[str | int, ...] = ()
    packed: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    header: bool = True
    separator: Annotated[str, Field(min_length=1, max_length=1)] = ","
    decimal: Literal[".", ","] = "."
    sample_rate_hz: _Rate | None = None
    period_ms: Annotated[float, Field(ge=1e-4, le=1000)] | None = None
    time: str | int | None = None
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    jitter_ms: Annotated[float, Field(ge=0)] | None = None
    resample_hz: _Rate | None = None
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
        return UNITS_MS[self.time_unit]

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.channels and self.packed:
            raise ValueError("channels or packed, not both")
        if self.sample_rate_hz and self.period_ms:
            raise ValueError("sample_rate_hz or period_ms, not both")
        if self.decimal == self.separator:
            raise ValueError("decimal and separator must differ")
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


class DataSetFile(forms.StrictForm):
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
    content = documents.read_toml(path, what)
    return documents.as_form(content, DataSetFile, path, what, "see docs/your-data.md")

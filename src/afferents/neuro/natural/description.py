"""What a TOML file says of recordings of natural afferents, and what classes are called."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from afferents.documents import as_form, read_toml
from afferents.errors import InputError
from afferents.forms import StrictForm

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
MM_S = {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0}
AXES = ("fibre", "texture", "speed", "repetition")
"""What the axes of cells are called; any other name is a condition's."""

_SEE = "see docs/neuroscience.md"
_Name = Annotated[str, Field(min_length=1)]
Labels = str | tuple[str | float | int, ...]
"""A variable of the file, or the values themselves."""


class Cells(StrictForm):
    """Where spike times are in a MATLAB file.

    Attributes
    ----------
    variable
        Such as ``spikes``, or ``data.spikes`` for a field of a struct or of an array of structs.
    levels
        For each cell array (or array of structs), the outermost first, what its dimensions are:
        ``[["fibre"], ["texture", "repetition"]]`` is a cell a fibre, in which there is a cell of
        textures x repetitions. After the last level come the times of one trial.
    unit
        Of times.
    empty
        Whether an empty cell is a trial without spikes or one that was not recorded. It must be
        said if there are empty cells and no `rates`.
    rates
        A variable with each trial's rate or number of spikes, nested as times are: NaN for a trial
        that was not recorded, 0 for one without spikes. It goes before `empty`.
    unsorted
        Whether times out of order are refused or sorted.
    cut
        Start and stop of a trial on the clock of the times, in their unit: spikes outside are left
        out, and times count from the start.
    """

    variable: _Name = "spikes"
    levels: tuple[tuple[_Name, ...], ...] = ()
    unit: Literal["s", "ms", "us"] = "s"
    empty: Literal["silence", "gap"] | None = None
    rates: _Name | None = None
    unsorted: Literal["refuse", "sort"] = "refuse"
    cut: tuple[float, float] | None = None

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of all dimensions, the outermost first."""
        return tuple(name for level in self.levels for name in level)

    @model_validator(mode="after")
    def _names_each_axis_once(self) -> Self:
        if any(not level for level in self.levels):
            raise ValueError("levels of at least one name each")
        if twice := [name for name in self.axes if self.axes.count(name) > 1]:
            raise ValueError(f"'{twice[0]}' stands twice in levels")
        if self.levels and not {"fibre", "texture"} <= set(self.axes):
            raise ValueError(
                "levels must name fibre and texture; a list of trials is read as a table (.csv)"
            )
        if self.cut and self.cut[0] >= self.cut[1]:
            raise ValueError("cut must start before it stops")
        return self


class Fibres(StrictForm):
    """What is known of the fibres.

    Attributes
    ----------
    classes
        A class each. ``SA1``, ``SA-I``, ``SAI``, ``RA1``, ``RA2``, ``FA-I``, ``PC`` and the like
        are known; `words` says what others stand for.
    names
        Numbered by class if not given.
    words
        ``SA``, ``RA`` or ``PC`` by what stands in the file.
    """

    classes: Labels = ()
    names: Labels = ()
    words: dict[str, Literal["SA", "RA", "PC"]] = Field(default_factory=dict)


class Trials(StrictForm):
    """What is known of the trials.

    Attributes
    ----------
    textures
        Names, in the order of the cells; numbered from 1 if not given.
    speeds_mm_s
        One for each speed in the cells, or one for all.
    speed_unknown
        Said where nobody knows the speed.
    speed_unit
        Of speeds that come from the file.
    duration_s
        One for all, or one for each speed, or a variable of the file (in s).
    durations_by
        Axes of that variable.
    conditions
        Values along other axes, by name.
    """

    textures: Labels = ()
    speeds_mm_s: Labels | PositiveFloat = ()
    speed_unknown: bool = False
    speed_unit: Literal["mm/s", "cm/s", "m/s"] = "mm/s"
    duration_s: PositiveFloat | tuple[PositiveFloat, ...] | str | None = None
    durations_by: tuple[str, ...] = ("speed",)
    conditions: dict[str, Labels] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _has_one_unit(self) -> Self:
        given = self.speeds_mm_s != () and not isinstance(self.speeds_mm_s, str)
        if given and self.speed_unit != "mm/s":
            raise ValueError("speed_unit is of speeds in the file; speeds_mm_s are in mm/s")
        return self


class Columns(StrictForm):
    """Columns of an NWB file's units and trials, or of a table with a row a spike.

    Attributes
    ----------
    fibre, fibre_class
        Of units. The column of fibres in an NWB file is ``unit_name`` if not given.
    texture, speed, repetition
        Of trials; speed and repetition may be missing.
    time
        Of a table.
    """

    fibre: str = "unit"
    fibre_class: str = "class"
    texture: str = "texture"
    speed: str = "speed_mm_s"
    repetition: str = "repetition"
    time: str = "time_s"


class NaturalFile(StrictForm):
    """A description of recordings of natural afferents.

    Attributes
    ----------
    title
        In a sentence: who recorded what, where it was published.
    file
        MATLAB (``.mat``), NWB (``.nwb``) or a table with a row a spike (``.csv``, ``.parquet``);
        relative to the description.
    """

    title: str = ""
    file: _Name
    spikes: Cells = Cells()
    fibres: Fibres = Fibres()
    trials: Trials = Trials()
    columns: Columns = Columns()


def read_description(path: Path) -> NaturalFile:
    """Read a description.

    Raises
    ------
    InputError
        Naming the first key that is missing, unknown or wrong.
    """
    what = "the description of natural afferents"
    return as_form(read_toml(path, what, _SEE), NaturalFile, path, what, _SEE)


# What afferents are called in files, as the package's three classes.

_KNOWN = {
    "SA": ("sa", "sa1", "sai", "slowlyadapting"),
    "RA": ("ra", "ra1", "rai", "fa1", "fai", "qa", "rapidlyadapting"),
    "PC": ("pc", "ra2", "raii", "fa2", "faii", "pacinian"),
}


def classes_of(words: Iterable[object], own: Mapping[str, str], where: Path | str) -> list[str]:
    """Return `SA`, `RA` or `PC` for each word.

    Parameters
    ----------
    own
        The user's words, which go first.

    Raises
    ------
    InputError
        Naming the first that is not known.
    """
    known = {word: name for name, all_words in _KNOWN.items() for word in all_words}
    found = []
    for word in words:
        text = as_text(word)
        name = own.get(text) or known.get(re.sub(r"[\W_]", "", text).lower())
        if name is None:
            raise InputError(
                f"{where}: expected classes SA, RA or PC of fibres, found '{text}'; say in words "
                f"which of them '{text}' is"
            )
        found.append(name)
    return found


def as_text(value: object) -> str:
    """Return a label as text: a whole number without a decimal point."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value.decode() if isinstance(value, bytes) else str(value)

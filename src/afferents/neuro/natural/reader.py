"""Natural afferents as `Spikes`: published recordings that a small TOML file describes."""

from collections.abc import Callable, Sequence
from pathlib import Path

from afferents.errors import InputError
from afferents.neuro.natural.cells import spikes_of_cells
from afferents.neuro.natural.description import (
    Cells,
    Columns,
    Fibres,
    NaturalFile,
    Trials,
    read_description,
)
from afferents.neuro.natural.tables import spikes_of_nwb, spikes_of_table
from afferents.spikes.population import Spikes

Reader = Callable[[Path, NaturalFile, Path], Spikes]
_IN_COLUMNS = {"words", "speeds_mm_s", "speed_unknown", "speed_unit", *Columns.model_fields}
_OF_TABLES = (spikes_of_table, _IN_COLUMNS | {"unit", "unsorted", "duration_s"})
_READERS: dict[str, tuple[Reader, set[str]]] = {
    ".mat": (spikes_of_cells, {*Cells.model_fields, *Fibres.model_fields, *Trials.model_fields}),
    ".nwb": (spikes_of_nwb, _IN_COLUMNS - {"time"}),
    ".csv": _OF_TABLES,
    ".parquet": _OF_TABLES,
}
"""By suffix, with the keys of the description that each reads, whichever table they stand in."""


def read_natural(description: str | Path) -> Spikes:
    """Read recordings of natural afferents.

    Parameters
    ----------
    description
        A TOML file that says which file holds them and which variable is what; see
        docs/neuroscience.md.

    Returns
    -------
    Spikes
        A unit a fibre; a trial a repetition of a texture at a speed. Fibres that were recorded one
        after another share trials, as if they had been recorded together; where a fibre has no
        such trial, `recorded` is False. `described_natural` says in sentences what is missing.

    Raises
    ------
    InputError
        If the description or the file is not what it should be, a key is not read of such a file,
        a variable is not there, two
        textures have one name, speeds are not given, times are negative, out of order, or lie
        beyond their trials, as those in ms do that are taken for s.
    """
    path = Path(description)
    described = read_description(path)
    file = path.parent / described.file
    suffix = file.suffix.lower()
    if suffix not in _READERS:
        raise InputError(
            f"{path}: expected a file of {', '.join(_READERS)}, found '{described.file}'"
        )
    if not file.is_file():
        raise InputError(
            f"{path}: expected the file '{described.file}' beside it, found no such file"
        )
    read, keys = _READERS[suffix]
    _require_read(described, keys, path)
    return read(file, described, path)


def _require_read(described: NaturalFile, keys: set[str], path: Path) -> None:
    """Refuse keys of a description that say nothing of such a file."""
    for table in ("spikes", "fibres", "trials", "columns"):
        if other := sorted(getattr(described, table).model_fields_set - keys):
            expected = f"what is read of {Path(described.file).suffix} files"
            raise InputError(
                f"{path}: expected {expected}, found '{other[0]}' in [{table}]; remove it"
            )


def described_natural(spikes: Spikes) -> list[str]:
    """Say in sentences what natural recordings hold and what is missing.

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
    said = [f"{_n(spikes.n_units, 'fibre')} ({of_class}), {_n(n_textures, 'texture')}{at}."]
    names, there = spikes.units.index.to_numpy(str), spikes.recorded.any(axis=0)
    fires = (spikes.counts() > 0).any(axis=0)
    if len(silent := names[there & ~fires].tolist()):
        said.append(f"Without any spike: {_listed(silent)}.")
    if len(absent := names[~there].tolist()):
        said.append(f"Never recorded: {_listed(absent)}.")
    if missing := int((~spikes.recorded).sum()):
        share = missing / spikes.recorded.size
        said.append(f"Not recorded: {missing} of {spikes.recorded.size} trains ({share:.0%}).")
    return said


def _n(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _listed(names: Sequence[str], most: int = 10) -> str:
    more = f" and {len(names) - most} others" if len(names) > most else ""
    return ", ".join(names[:most]) + more

"""Tables of numbers in files: CSV, Parquet, NPY, NPZ, HDF5 and sound, read as columns.

To add a format, write a function from a path and the `[signal]` of a `dataset.toml` to a `Table`,
and name its suffix in `FORMATS`.
"""

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import AfferentsError, InputError, reason_of
from afferents.core.extras import import_extra
from afferents.recordings.data_set_file import Signal

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
        raise InputError(path, known, f"'{path.suffix}'", "say which in [signal] format")
    if not path.is_file():
        raise InputError(path, f"a readable {suffix.upper()} file", "no such file")
    try:
        return FORMATS[suffix](path, signal)
    except AfferentsError:
        raise
    except Exception as error:  # readers of other packages raise what they like
        expected = f"a readable {suffix.upper()} file"
        raise InputError(path, expected, reason_of(error)) from error


def _csv(path: Path, signal: Signal) -> Table:
    text = path.read_text(encoding="utf-8-sig", errors="replace").rstrip()
    header, _, body = text.partition("\n") if signal.header else ("", "", text)
    first = 2 if signal.header else 1
    names = [name.strip() for name in header.split(signal.separator)]
    if not signal.header:
        n = len(body.partition("\n")[0].split(signal.separator))
        names = [str(number) for number in range(n)]
    if signal.columns and names != list(signal.columns):
        expected = f"the columns {', '.join(signal.columns)}"
        raise InputError(f"{path}, line 1", expected, f"{names}")
    if not body.strip():
        raise InputError(path, "rows of data below the header", "none")
    values = _fast(body, names, signal)
    if values is None:
        raise _fault(path, body, names, signal, first)
    return Table(tuple(names), values, np.arange(len(values)) + first, "line")


def _fast(body: str, names: Sequence[str], signal: Signal) -> Numbers | None:
    """Return the numbers of a CSV without its header; None where something is at fault."""
    import pandas as pd

    dtype = np.int64 if signal.integers else np.float64
    try:
        frame = pd.read_csv(
            io.StringIO(body), sep=signal.separator, header=None, index_col=False,
            skip_blank_lines=False, dtype=dtype, keep_default_na=False, na_values=[""],
            quoting=csv.QUOTE_NONE,
        )  # fmt: skip
    except ValueError:  # of pandas' parser as well
        return None
    values = np.asarray(frame.to_numpy(), np.float64)
    whole = values.shape[1] == len(names) and bool(np.isfinite(values).all())
    return values if whole else None


def _fault(path: Path, body: str, names: Sequence[str], signal: Signal, first: int) -> InputError:
    """Return what is wrong with the first line at fault."""
    kind = "integers" if signal.integers else "numbers"
    for number, line in enumerate(body.split("\n"), start=first):
        fields = line.rstrip("\r").split(signal.separator)
        if len(fields) != len(names):
            return InputError(f"{path}, line {number}", f"{len(names)} fields", f"{len(fields)}")
        for field in fields:
            if not _is_number(field, signal.integers):
                return InputError(f"{path}, line {number}", kind, f"'{field.strip()}'")
    return InputError(path, f"a table of {kind}", "one that can't be read")


def _is_number(field: str, integer: bool) -> bool:
    if "_" in field:  # which Python allows in numbers
        return False
    try:
        return bool(np.isfinite(int(field) if integer else float(field)))
    except (ValueError, TypeError):
        return False


def _parquet(path: Path, signal: Signal) -> Table:
    import pandas as pd

    frame = pd.read_parquet(path)
    return _columns(path, {str(name): frame[name].to_numpy() for name in frame.columns})


def _npy(path: Path, signal: Signal) -> Table:
    return _columns(path, _parts("", np.load(path, allow_pickle=False)))


def _npz(path: Path, signal: Signal) -> Table:
    with np.load(path, allow_pickle=False) as arrays:
        wanted = _wanted(path, list(arrays), signal)
        return _columns(path, _joined((key, arrays[key]) for key in wanted))


def _hdf5(path: Path, signal: Signal) -> Table:
    h5py = import_extra("hdf5", str(path), "h5py")
    with h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(lambda name, one: names.append(name) if hasattr(one, "shape") else None)
        wanted = _wanted(path, names, signal)
        return _columns(path, _joined((key, file[key][()]) for key in wanted))


def _sound(path: Path, signal: Signal) -> Table:
    import soundfile

    samples, rate_hz = soundfile.read(path, dtype="float64", always_2d=True)
    table = _columns(path, _parts("", samples))
    return table._replace(rate_hz=float(rate_hz))


def _wanted(path: Path, there: Sequence[str], signal: Signal) -> Sequence[str]:
    """Return the arrays of a file that are read: those named, else all."""
    if missing := [key for key in signal.arrays if key not in there]:
        found = ", ".join(there) or "none"
        raise InputError(path, f"the array '{missing[0]}'", found, "name it in [signal] arrays")
    return signal.arrays or there


def _joined(arrays: Any) -> dict[str, Any]:
    return {name: part for key, array in arrays for name, part in _parts(key, array).items()}


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
            raise InputError(path, expected, found, "name those to read in [signal] arrays")
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1:
        expected = "columns of one length"
        found = ", ".join(f"{name} of {n}" for name, n in lengths.items()) or "none"
        raise InputError(path, expected, found, "name those to read in [signal] arrays")
    values = np.stack([np.asarray(v, np.float64) for v in columns.values()], axis=1)
    if not len(values):
        raise InputError(path, "rows of data", "none")
    return Table(tuple(columns), values, np.arange(len(values)))


Reader = Callable[[Path, Signal], Table]
FORMATS: dict[str, Reader] = {
    "csv": _csv,
    "parquet": _parquet,
    "npy": _npy,
    "npz": _npz,
    "wav": _sound,
    "flac": _sound,
    "h5": _hdf5,
    "hdf5": _hdf5,
}
"""By suffix."""

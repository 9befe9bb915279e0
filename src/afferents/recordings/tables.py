"""Tables of numbers in files: CSV, Parquet, NPY, NPZ, HDF5, MATLAB and sound, read as columns.

To add a format, write a function from a path and the `[signal]` of a `dataset.toml` to a `Table`,
and name its suffix in `FORMATS`.
"""

import codecs
import csv
import fnmatch
import io
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError, reading
from afferents.plugins import import_extra
from afferents.recordings.audio import WavFile, sound_name
from afferents.recordings.description import Signal

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_UNIT = re.compile(r"(?![-+.]?\d)(?!(?i:[-+]?(?:nan|inf(?:inity)?))$).*")
"""What no row of numbers holds: neither a number nor what stands for one."""
_DIALECTS = (*product(",;\t ", "."), *product(";\t ", ","))
"""What separates fields, and decimals. Of those that fit equally well the first counts."""
_LINES = 200
"""By which they are told."""
_COMMA_POINT = str.maketrans(",.", ".,")
Numbers = NDArray[np.float64]


class Table(NamedTuple):
    """A table of numbers.

    Attributes
    ----------
    columns
        Their names; where a file has none, their numbers from 0.
    values
        (row, column), float64; NaN where there is no number.
    place
        Where each row stands in the file, (row,): lines from 1, or rows from 0.
    unit
        What `place` counts: ``line`` or ``row``.
    rate_hz
        Sample rate that the file declares, None where it declares none.
    time
        (row,), the column of times if it is kept apart, in its own unit.
    """

    columns: tuple[str, ...]
    values: Numbers
    place: NDArray[np.int64]
    unit: str = "row"
    rate_hz: float | None = None
    time: Numbers | None = None


def read_columns(path: Path, signal: Signal) -> Table:
    """Read all columns of a file, those of texts as NaN.

    Raises
    ------
    InputError
        If it can't be read, or holds no table.
    """
    suffix = signal.format or path.suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        known = f"a file of {', '.join(FORMATS)}"
        raise InputError(
            f"{path}: expected {known}, found '{path.suffix}'; say which in [signal] format"
        )
    with reading(path, f"a readable {suffix.upper()} file"):
        return FORMATS[suffix](path, signal)


def read_table(path: Path, signal: Signal) -> Table:
    """Read the channels of a file, and its times apart; other columns may hold anything.

    Raises
    ------
    InputError
        If it can't be read, lacks a column, or one that is read holds something else than numbers;
        of a CSV it names the line.
    """
    table = read_columns(path, signal)
    times = [] if signal.time is None else _find_columns(path, table, signal.time)[:1]
    packed = [_find_columns(path, table, wanted) for wanted in signal.packed]
    names = [
        n for wanted in signal.channels or signal.packed for n in _find_columns(path, table, wanted)
    ]
    names = names or [name for name in table.columns if name not in times]
    if twice := [name for name, n in Counter(names).items() if n > 1]:
        raise InputError(f"{path}: expected each channel once, found '{twice[0]}' twice")
    read = [table.columns.index(name) for name in [*names, *times]]
    values = table.values[:, read]
    if table.unit == "line" and not np.isfinite(values).all():
        raise _find_fault(path, signal, table.columns, read)
    texts = np.isnan(values).all(axis=0)
    if texts.any():
        text = table.columns[read[int(np.argmax(texts))]]
        raise InputError(
            f"{path}: expected numbers in the column '{text}', found none; name the columns to "
            "read in [signal] channels"
        )
    time = values[:, -1] if times else None
    table = table._replace(columns=tuple(names), values=values[:, : len(names)], time=time)
    return _unpack(path, table, signal.packed, packed) if packed else table


def _unpack(
    path: Path, table: Table, channels: Sequence[str], packed: Sequence[Sequence[str]]
) -> Table:
    """Return a table with a row a sample, of rows that hold several of each channel."""
    n = len(packed[0])
    if other := next((columns for columns in packed if len(columns) != n), None):
        raise InputError(
            f"{path}: expected as many columns in each of [signal] packed, found {n} and "
            f"{len(other)}"
        )
    rows = len(table.values)
    values = table.values.reshape(rows, len(packed), n).swapaxes(1, 2).reshape(-1, len(packed))
    time = table.time
    if time is not None:  # of the first sample of each row; the last row lasts as the one before
        last = time[-1] + (time[-1] - time[-2] if rows > 1 else 0)
        time = np.interp(np.arange(rows * n) / n, np.arange(rows + 1), np.append(time, last))
    names = tuple(name.rstrip("*") or name for name in channels)
    return table._replace(columns=names, values=values, place=np.repeat(table.place, n), time=time)


def _find_columns(path: Path, table: Table, wanted: str | int) -> Sequence[str]:
    """Return the columns of a name, a pattern or a number."""
    name = str(wanted)
    if isinstance(wanted, int) and name not in table.columns and wanted < len(table.columns):
        return [table.columns[wanted]]
    found = [name] if name in table.columns else fnmatch.filter(table.columns, name)
    if not found:
        where = f"{path}, line 1" if table.unit == "line" else path
        raise InputError(f"{where}: expected the column '{name}', found {', '.join(table.columns)}")
    return found


def _require_different(path: Path, names: Sequence[str]) -> None:
    if twice := [name for name, n in Counter(names).items() if n > 1]:
        raise InputError(
            f"{path}: expected columns of different names, found '{twice[0]}' twice; rename one"
        )


def _read_csv(path: Path, signal: Signal) -> Table:
    import pandas as pd

    names, first, text = _read_head(path, signal)
    _require_different(path, names)
    if signal.columns and names != list(signal.columns):
        expected = f"the columns {', '.join(signal.columns)}"
        raise InputError(f"{path}, line 1: expected {expected}, found {names}")
    if not text:
        raise InputError(f"{path}: expected rows of data below the header, found none")
    options: dict[str, Any] = {
        "sep": r"\s+" if signal.separator == " " else signal.separator, "header": None,
        "index_col": False, "skip_blank_lines": False, "keep_default_na": False,
    }  # fmt: skip
    number: dict[str, Any] = {"dtype": np.float64, "na_values": [""], "decimal": signal.decimal}
    try:
        frame = pd.read_csv(io.StringIO(text), **options, **number)
    except ValueError:  # of pandas' parser as well
        try:
            texts = pd.read_csv(io.StringIO(text), **options, dtype=str).fillna("")
        except ValueError:
            raise _find_fault(path, signal, names, ()) from None
        points = texts.apply(lambda one: one.str.replace(signal.decimal, "."))
        frame = points.apply(pd.to_numeric, errors="coerce")
    while frame.shape[1] > len(names) and frame.iloc[:, -1].isna().all():
        frame = frame.iloc[:, :-1]  # rows that end in a separator
    if frame.shape[1] != len(names):
        raise _find_fault(path, signal, names, ())
    values = frame.to_numpy(np.float64)
    return Table(tuple(names), values, np.arange(len(values)) + first, "line")


def read_texts(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the number of each line of a CSV, and its fields as texts by name of the column.

    Raises
    ------
    InputError
        If it can't be read, or a line has more or fewer fields than names.
    """
    with reading(path, "a readable CSV file"), _open_text(path) as file:
        first = file.readline()
        separator = max(",;\t", key=first.count)
        names = _split(first, separator)
        for number, line in enumerate(file, start=2):
            if not line.strip():
                continue
            fields = _split(line, separator)
            if len(fields) != len(names):
                raise InputError(
                    f"{path}, line {number}: expected {len(names)} fields, found {len(fields)}"
                )
            yield number, dict(zip(names, fields, strict=True))


def _open_text(path: Path) -> io.TextIOWrapper:
    """Open a file of text, in UTF-16 where its first bytes declare that, else in UTF-8."""
    with path.open("rb") as file:
        wide = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    return path.open(encoding="utf-16" if wide else "utf-8-sig", errors="replace")


def _split(line: str, separator: str) -> list[str]:
    """Return what stands between separators, without quotes and blanks around it."""
    (fields,) = csv.reader([line.strip("\r\n")], delimiter=separator, skipinitialspace=True)
    return [field.strip() for field in fields] or [""]


def _is_number(field: str, decimal: str) -> bool:
    """Return whether a field is a number."""
    swapped = field.translate(_COMMA_POINT) if decimal == "," else field
    return NUMBER.fullmatch(swapped) is not None


def _read_head(path: Path, signal: Signal) -> tuple[list[str], int, str]:
    """Return the names of a CSV's columns, the number of its first row's line, and all rows.

    Comments, which begin with ``#``, and a row of units below the names are left out. Where numbers
    follow the comments, the last of these holds the names, as NumPy writes them.
    """
    with _open_text(path) as file:
        comment, line, n = "", file.readline(), 1
        while line.startswith("#"):
            comment, line, n = line.lstrip("# "), file.readline(), n + 1
        header = _split(line, signal.separator)
        if signal.header:
            if comment and all(_is_number(field, signal.decimal) for field in header):
                header = _split(comment, signal.separator)
            else:
                line, n = file.readline(), n + 1
            below = _split(line, signal.separator)
            if len(below) == len(header) and any(below) and all(map(_UNIT.fullmatch, below)):
                line, n = file.readline(), n + 1
        while len(header) > 1 and not header[-1]:
            header.pop()
        names = [(signal.header and name) or str(number) for number, name in enumerate(header)]
        return names, n, (line + file.read()).rstrip()


def _find_fault(
    path: Path, signal: Signal, names: Sequence[str], read: Iterable[int]
) -> InputError:
    """Return what is wrong with the first line at fault, in the columns that are read."""
    _, first, text = _read_head(path, signal)
    for number, line in enumerate(text.split("\n"), start=first):
        fields = _split(line, signal.separator)
        while len(fields) > len(names) and not fields[-1]:
            fields.pop()
        if len(fields) != len(names):
            found = f"expected {len(names)} fields, found {len(fields)}"
            do = "; decimal commas need decimal = ',' and another separator" * (number == first)
            return InputError(f"{path}, line {number}: {found}{do}")
        wrong = [fields[n] for n in read if not _is_number(fields[n], signal.decimal)]
        if wrong:
            return InputError(
                f"{path}, line {number}: expected numbers, found '{wrong[0]}'; mend the line, or "
                "name the columns to read in [signal] channels"
            )
    return InputError(f"{path}: expected a table of numbers, found one that can't be read")


def find_dialect(path: Path) -> Signal:
    """Return what separates fields and decimals of a CSV, and whether it has names of columns.

    Pairs of whole numbers are single ones with a decimal comma where the file names one column; or
    names none, and the second ones begin with zeros, or are equally long after hardly any first.

    Raises
    ------
    InputError
        If it can't be read.
    """
    with reading(path, "a readable CSV file"), _open_text(path) as file:
        lines = [line.strip("\r\n") for line in islice(file, _LINES) if line.strip()]
    rows = [line for line in lines if not line.startswith("#")] or [""]

    def fit(line: str, separator: str, decimal: str) -> int:
        fields = filter(None, _split(line, separator))
        return sum(1 if _is_number(field, decimal) else -1 for field in fields)

    best = max(_DIALECTS, key=lambda one: sum(fit(row, *one) for row in rows[len(rows) // 2 :]))
    names = _split(rows[0], best[0])
    header = fit(rows[0], *best) < sum(map(bool, names)) or rows == [""]
    if not header and len(rows) < len(lines):  # as NumPy writes names
        comment = lines[lines.index(rows[0]) - 1].lstrip("# ")
        header = len(_split(comment, best[0])) == len(names)
    pairs = [row.split(",") for row in rows[header:] if re.fullmatch(r"[-+]?\d+,\d+", row)]
    if pairs and len(pairs) == len(rows) - header:
        first, second = ({*column} for column in zip(*pairs, strict=True))
        alike = len(first) <= 3 < len(pairs) and len({*map(len, second)}) == 1 < len(pairs[0][1])
        padded = any(re.match(r"0\d", one) for one in second)
        if len(names) == 1 if header else alike or padded:
            best = (";", ",")
    return Signal(separator=best[0], decimal=best[1], header=header)


def _read_parquet(path: Path, signal: Signal) -> Table:
    import_extra("parquet", str(path), "pyarrow")
    import pandas as pd

    frame = pd.read_parquet(path.absolute(), columns=list(signal.arrays) or None)
    return _make_table(path, ((str(name), frame[name].to_numpy()) for name in frame.columns))


def _read_numpy(path: Path, signal: Signal) -> Table:
    found = np.load(path, allow_pickle=False)
    if isinstance(found, np.ndarray):
        return _make_table(path, [("", found)])
    with found:
        wanted = _choose_arrays(path, list(found), signal)
        return _make_table(path, ((key, found[key]) for key in wanted))


def _read_hdf5(path: Path, signal: Signal, matlab: bool = False) -> Table:
    h5py = import_extra("hdf5", str(path), "h5py")
    with h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(lambda name, one: names.append(name) if hasattr(one, "shape") else None)
        wanted = _choose_arrays(path, names, signal)
        arrays = {key: np.asarray(file[key][()]) for key in wanted}
    if matlab:
        arrays = {key: array.T.squeeze() for key, array in arrays.items()}
    return _make_table(path, arrays.items())


def _read_matlab(path: Path, signal: Signal) -> Table:
    """Read a MATLAB file: of version 7.3, which is HDF5, with h5py, else with SciPy."""
    from scipy.io import loadmat

    try:
        found = loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError:  # version 7.3, which keeps arrays the other way round
        return _read_hdf5(path, signal, matlab=True)
    there = _flatten({name: one for name, one in found.items() if not name.startswith("__")})
    wanted = _choose_arrays(path, list(there), signal)
    if not signal.arrays:  # the texts and single numbers of a struct are no columns
        wanted = [name for name in wanted if np.ndim(there[name])]
    return _make_table(path, ((key, there[key]) for key in wanted))


def _flatten(group: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return the arrays of structs in structs, named by their path."""
    there: dict[str, Any] = {}
    for name, one in group.items():
        if isinstance(one, Mapping):
            there |= _flatten(one, f"{above}{name}/")
        else:
            there[above + name] = one
    return there


def _read_sound(path: Path, signal: Signal) -> Table:
    import soundfile

    samples, rate_hz = soundfile.read(sound_name(path), dtype="float64", always_2d=True)
    _ = WavFile(path, 0).header  # refuses one that was cut off
    table = _make_table(path, [("", samples)])
    return table._replace(rate_hz=float(rate_hz))


def _choose_arrays(path: Path, there: Sequence[str], signal: Signal) -> Sequence[str]:
    """Return the arrays of a file that are read: those named, else all."""
    if missing := [key for key in signal.arrays if key not in there]:
        found = ", ".join(there) or "none"
        raise InputError(
            f"{path}: expected the array '{missing[0]}', found {found}; name it in [signal] arrays"
        )
    return signal.arrays or there


def _make_table(path: Path, arrays: Iterable[tuple[str, Any]]) -> Table:
    """Return a table of arrays, each a column or (row, column), numbered after its name.

    Columns must be equally long; what holds no numbers is NaN.
    """
    parts: list[tuple[str, Any]] = []
    for key, array in ((key, np.asarray(array)) for key, array in arrays):
        if array.ndim == 2:
            parts += [(f"{key}{number}", column) for number, column in enumerate(array.T)]
        else:
            parts.append((key or "0", array))
    columns = dict(parts)
    _require_different(path, [name for name, _ in parts])
    for name, values in columns.items():
        if values.ndim != 1:
            found = f"{values.ndim} dims of {values.dtype} in '{name}'"
            raise InputError(
                f"{path}: expected columns, found {found}; name those to read in [signal] arrays"
            )
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) != 1:
        expected = "columns of one length"
        found = ", ".join(f"{name} of {n}" for name, n in lengths.items()) or "none"
        raise InputError(
            f"{path}: expected {expected}, found {found}; name those to read in [signal] arrays"
        )
    numbers = [v if v.dtype.kind in "iuf" else np.full(len(v), np.nan) for v in columns.values()]
    values = np.stack([np.asarray(v, np.float64) for v in numbers], axis=1)
    if not len(values):
        raise InputError(f"{path}: expected rows of data, found none")
    return Table(tuple(columns), values, np.arange(len(values)))


Reader = Callable[[Path, Signal], Table]
FORMATS: dict[str, Reader] = {
    "csv": _read_csv,
    "parquet": _read_parquet,
    "npy": _read_numpy,
    "npz": _read_numpy,
    "wav": _read_sound,
    "flac": _read_sound,
    "h5": _read_hdf5,
    "hdf5": _read_hdf5,
    "mat": _read_matlab,
}
"""By suffix."""

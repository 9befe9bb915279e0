"""Variables of MATLAB files, of version 5 or 7.3, as plain arrays.

Both kinds come out alike: a cell array and an array of structs are arrays of objects, a struct is
a dict, text is a str, numbers are arrays, in MATLAB's own order of dimensions.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError, reading
from afferents.plugins import import_extra

_HDF5 = b"\x89HDF\r\n\x1a\n"
_DO = "export it again from MATLAB with save, or take another file"


def read_variables(path: Path, *names: str) -> dict[str, Any]:
    """Return variables of a MATLAB file, by name.

    Parameters
    ----------
    names
        Of variables, or of fields of structs as ``data.spikes``; of an array of structs, that field
        of each.

    Raises
    ------
    InputError
        If the file is missing or damaged, `h5py` is needed and missing, or a variable is not in
        it; then those that are there are listed.
    """
    wanted = {name.partition(".")[0] for name in names}
    with reading(path, "a MATLAB file", do=_DO):
        found = (_read_hdf5 if _is_hdf5(path) else _read_v5)(path, wanted)
    return {
        name: _field(found[first], others, name, path)
        for name in names
        for first, *others in [name.split(".")]
    }


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return _HDF5 in (head[:8], head[512:520]) or head.startswith(b"MATLAB 7.3")


def _require(path: Path, wanted: set[str], there: list[str]) -> None:
    if missing := sorted(wanted - set(there)):
        found = f"variables {', '.join(there)}" if there else "no variables"
        raise InputError(
            f"{path}: expected the variable '{missing[0]}', found {found}; name one of them"
        )


def _read_v5(path: Path, wanted: set[str]) -> dict[str, Any]:
    from scipy.io import loadmat, whosmat

    _require(path, wanted, [name for name, *_ in whosmat(str(path))])
    content = loadmat(str(path), variable_names=sorted(wanted), squeeze_me=False)
    return {name: _plain(content[name]) for name in wanted}


def _plain(value: Any) -> Any:
    """Return what SciPy read in the form that this module promises."""
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names:
        structs = _structs({name: _plain(value[name]) for name in value.dtype.names})
        return structs.item() if structs.size == 1 else structs
    if value.dtype.kind == "O":
        return _mapped(_plain, value)
    if value.dtype.kind == "U":
        rows = _mapped(str.strip, value)  # of a char matrix; an empty one is an empty text
        return rows if rows.size > 1 else "".join(rows.ravel())
    return value


def _structs(fields: dict[str, NDArray[Any]]) -> NDArray[Any]:
    """Return an array of structs, from the array of each of their fields."""
    found = np.empty(next(iter(fields.values())).shape, object)
    for at in np.ndindex(found.shape):
        found[at] = {name: values[at] for name, values in fields.items()}
    return found


def _mapped(of: Callable[[Any], Any], array: NDArray[Any]) -> NDArray[Any]:
    """Return an array of objects, each made by `of`."""
    return np.asarray(np.frompyfunc(of, 1, 1)(array), object)


def _read_hdf5(path: Path, wanted: set[str]) -> dict[str, Any]:
    h5py = import_extra("hdf5", str(path), "h5py")
    with h5py.File(path, "r") as file:
        _require(path, wanted, [name for name in file if not name.startswith("#")])
        return {name: _Hdf5(h5py, file).plain(file[name]) for name in wanted}


class _Hdf5:
    """Reads what MATLAB writes into HDF5: dimensions turned round, cells as references."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self._h5py, self._file = h5py, file

    def plain(self, item: Any) -> Any:
        if isinstance(item, self._h5py.Group):
            return self._struct(item)
        kind = self._class(item)
        if item.attrs.get("MATLAB_empty", 0):
            if kind == "char":
                return ""
            sizes = item[()].astype(int)  # MATLAB writes the size in place of the content
            return np.empty(tuple(sizes), object if kind == "cell" else np.float64)
        if self._refers(item):
            return self._followed(item)
        values = np.asarray(item[()]).T
        if kind == "char":
            rows = ["".join(map(chr, row)).strip() for row in np.atleast_2d(values)]
            return rows[0] if len(rows) == 1 else np.array(rows, object)
        return values

    def _struct(self, group: Any) -> Any:
        """Return a struct as a dict; an array of them is a group of arrays of references."""
        if len(group) and all(
            self._refers(field) and self._class(field) != "cell" for field in group.values()
        ):
            return _structs({name: self._followed(field) for name, field in group.items()})
        return {name: self.plain(field) for name, field in group.items()}

    def _refers(self, item: Any) -> bool:
        is_dataset = isinstance(item, self._h5py.Dataset)
        return is_dataset and self._h5py.check_ref_dtype(item.dtype) is not None

    def _followed(self, item: Any) -> NDArray[Any]:
        return _mapped(lambda reference: self.plain(self._file[reference]), item[()].T)

    @staticmethod
    def _class(item: Any) -> str:
        kind = item.attrs.get("MATLAB_class", b"")
        return kind.decode() if isinstance(kind, bytes) else str(kind)


def _field(value: Any, names: list[str], name: str, path: Path) -> Any:
    """Return the field of a struct that names lead to; of many structs, of each."""
    if not names:
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        return _mapped(lambda one: _field(one, names, name, path), value)
    part, *others = names
    fields = value if isinstance(value, dict) else {}
    if part not in fields:
        found = f"fields {', '.join(fields)}" if fields else "no struct"
        raise InputError(f"{path}: expected the field '{part}', for {name}, found {found}")
    return _field(fields[part], others, name, path)

"""The kinds of data set by name, and which one a path is."""

import re
from collections.abc import Mapping
from importlib.util import find_spec
from inspect import isclass
from pathlib import Path
from typing import Any

from afferents.errors import InputError
from afferents.plugins import named, reference_of
from afferents.recordings.data_set import DataSet
from afferents.recordings.described import PACKAGED, Described
from afferents.recordings.session import PublishedSession
from afferents.store.integrity import is_group
from afferents.store.recording import RecordingSet
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses, store_config


class Stored(DataSet):
    """Responses that were extracted; what they were extracted from is not asked for again."""

    name, title = "store", "A store"

    @classmethod
    def is_at(cls, path: Path) -> bool:
        """Tell whether there is a Zarr store."""
        return is_group(path)

    def recordings(self) -> RecordingSet:
        """Refuse: a store holds none."""
        raise InputError(f"{self.path}: expected recordings, found a store of their responses")

    def responses(self) -> list[Responses]:
        """Open all recordings of the store, lazily, in order of texture and speed."""
        return open_responses(self.path)

    def config(self) -> Mapping[str, Any]:
        """Return the configuration that the store was extracted with."""
        return store_config(self.path)


# The data sets by name, and which one a path is of.

DATA_SETS: dict[str, type[DataSet]] = {
    kind.name: kind for kind in (Stored, Described, PublishedSession)
}
"""A path that comes without a name is of the first that knows it, else of the last."""

_OWN = re.compile(r"(?P<where>(?:.+\.py|\w[\w.]*):[^\W\d][\w.]*)(?::(?P<path>.+))?")


def data_set_of(wanted: str | Path | DataSet) -> DataSet:
    """Return the data set that a user means.

    Parameters
    ----------
    wanted
        A path, ``NAME:PATH`` with a name in `DATA_SETS` or `PACKAGED`, a `DataSet` of one's own,
        or where one is: ``file.py:NAME``, ``package.module:NAME``, or, of a class,
        ``file.py:NAME:PATH``.

    Raises
    ------
    InputError
        If there is no data set of one's own where it is said to be, or a folder without a name
        holds files of several data sets.
    """
    if isinstance(wanted, DataSet):
        return wanted
    name, colon, path = str(wanted).partition(":")
    if colon and name in DATA_SETS:
        return DATA_SETS[name](path)
    if colon and name in PACKAGED:
        return Described(path, PACKAGED[name])
    there = Path(wanted)
    is_word = re.fullmatch(r"\w\w+", name) and ":" not in path and not there.exists()
    if colon and is_word and find_spec(name) is None:
        known = ", ".join([*DATA_SETS, *PACKAGED])
        raise InputError(
            f"{wanted}: expected a path, NAME:PATH with a NAME of {known}, or a data set of your "
            "own as FILE.py:NAME, found none of them"
        )
    if (own := _OWN.fullmatch(str(wanted))) and not there.exists():
        return _own(own["where"], own["path"])
    *others, last = DATA_SETS.values()
    kind = next((kind for kind in others if kind.is_at(there)), None)
    return kind(there) if kind else _packaged(there) or last(there)


def source_of(wanted: str | Path | DataSet) -> str:
    """Return what `data_set_of` finds it by again; of an object its class and path, if it can."""
    if not isinstance(wanted, DataSet) or type(wanted) in DATA_SETS.values():
        return str(wanted)
    try:
        return f"{reference_of(type(wanted))}:{wanted.path}"
    except InputError:  # made in a script or a notebook
        return str(wanted)


def _packaged(path: Path) -> DataSet | None:
    """Return the data set that the package describes and whose files lie in a folder."""
    if not path.is_dir():
        return None
    described = [Described(path, description) for description in PACKAGED.values()]
    found = [one for one in described if one.matching(look=True)]
    if len(found) > 1:
        raise InputError(
            f"{path}: expected files of one data set, found those of "
            f"{' and '.join(one.title for one in found)}; say which: "
            f"{' or '.join(map(str, found))}"
        )
    return found[0] if found else None


def _own(where: str, path: str | None) -> DataSet:
    found = named(where)
    if path is not None and isclass(found) and issubclass(found, DataSet):
        return found(path)
    if path is not None or not isinstance(found, DataSet):
        expected = f"an afferents.DataSet at {where}, or a class of them and a path"
        raise InputError(f"DATA: expected {expected}, found {type(found).__name__}")
    return found

"""The formats of recordings, a reader each, and which of them a path is of."""

import re
from collections.abc import Mapping
from importlib.metadata import entry_points
from importlib.util import find_spec
from inspect import isclass
from pathlib import Path
from typing import Any

from afferents.errors import InputError
from afferents.plugins import imported, in_a_sentence, named, reference_of
from afferents.recordings.data_set import DataSet
from afferents.recordings.described import PACKAGED, Described
from afferents.recordings.media import refuse_bag
from afferents.recordings.session import Pictures, PublishedSession, Session
from afferents.recordings.tactile_bench import Runs, Streams
from afferents.store import integrity, zarr_store
from afferents.store.recording import RecordingSet
from afferents.store.responses import Responses


class Stored(DataSet):
    """Responses that were extracted; their sources are not needed again."""

    name, title = "store", "A store"

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether there is a Zarr store."""
        return integrity.is_group(path)

    def scan(self) -> RecordingSet:
        """Refuse: a store holds none."""
        raise InputError(f"{self.path}: expected recordings, found a store of their responses")

    def responses(self) -> list[Responses]:
        """Open all recordings of the store, lazily, in order of texture and speed."""
        return zarr_store.open_responses(self.path)

    def config(self) -> Mapping[str, Any]:
        """Return the configuration that the store was extracted with."""
        return zarr_store.store_config(self.path)


DATA_SETS: dict[str, type[DataSet]] = {
    kind.name: kind for kind in (Stored, Described, Streams, Runs, Pictures, PublishedSession)
}
"""Those of the package. A path that comes without a name is of the first that recognises it, else
of the last."""
ENTRY_POINTS = "afferents.recordings"
"""Group of the entry points by which other packages add readers."""


def readers() -> dict[str, type[DataSet]]:
    """Return all readers by name: the package's, and those that installed packages add.

    Raises
    ------
    InputError
        If one can't be imported, is no `DataSet`, or has the name of another.
    """
    found = dict(DATA_SETS)
    for point in entry_points(group=ENTRY_POINTS):
        where = f"entry point '{point.name}' ({point.value})"
        kind = imported(point.value, where)
        if not (isclass(kind) and issubclass(kind, DataSet) and kind.name not in found):
            raise InputError(
                f"{where}: expected a class of afferents.DataSet with a name of its own, found "
                f"{getattr(kind, 'name', kind)!r}; mend or uninstall the package that has it"
            )
        found[kind.name] = kind
    return found


def _recognised(path: Path) -> DataSet:
    """Return the data set that a path without a name is.

    Raises
    ------
    InputError
        If a reader of another package raises, or recognises what another reader does.
    """
    claims: list[type[DataSet]] = []
    for kind in readers().values():
        if claims and kind.name in DATA_SETS:  # the package's first is enough
            continue
        with in_a_sentence(f"{path}, reader '{kind.name}'"):
            claims += [kind] if kind.recognises(path) else []
    if len(claims) > 1 and any(kind.name not in DATA_SETS for kind in claims):
        names = [kind.name for kind in claims]
        raise InputError(
            f"{path}: expected files of one reader, found that {' and '.join(names)} take them for "
            f"theirs; say which: {' or '.join(f'{name}:{path}' for name in names)}"
        )
    *_, last = DATA_SETS.values()
    first = next((kind for kind in claims if kind is not last), None)
    if found := first(path) if first else _packaged(path):
        return found
    if not claims:
        refuse_bag(path)
    return last(path)


_OWN = re.compile(r"(?P<where>(?:.+\.py|\w[\w.]*):[^\W\d][\w.]*)(?::(?P<path>.+))?")


def data_set_of(wanted: str | Path | DataSet) -> DataSet:
    """Return the data set that a user means.

    Parameters
    ----------
    wanted
        A path, ``NAME:PATH`` with a name in `readers` or `PACKAGED`, your own `DataSet`,
        or where one is: ``file.py:NAME``, ``package.module:NAME``, or, of a class,
        ``file.py:NAME:PATH``.

    Raises
    ------
    InputError
        If there is no data set of your own where the path says, or a folder without a name
        holds files of several data sets.
    """
    if isinstance(wanted, DataSet):
        return wanted
    name, colon, path = str(wanted).partition(":")
    kinds = readers() if colon else {}
    if name in kinds:
        return kinds[name](path)
    if colon and name in PACKAGED:
        return Described(path, PACKAGED[name])
    there = Path(wanted)
    is_word = re.fullmatch(r"\w\w+", name) and ":" not in path and not there.exists()
    if colon and is_word and find_spec(name) is None:
        known = ", ".join([*kinds, *PACKAGED])
        raise InputError(
            f"{wanted}: expected a path, NAME:PATH with a NAME of {known}, or a data set of your "
            "own as FILE.py:NAME, found none of them"
        )
    if (own := _OWN.fullmatch(str(wanted))) and not there.exists():
        found, path = named(own["where"]), own["path"]
        if path is not None and isclass(found) and issubclass(found, DataSet):
            return found(path)
        if path is not None or not isinstance(found, DataSet):
            expected = f"an afferents.DataSet at {own['where']}, or a class of them and a path"
            raise InputError(f"DATA: expected {expected}, found {type(found).__name__}")
        return found
    return _recognised(there)


def read_session(root: str | Path, fps_hz: float | None = None) -> Session:
    """Read a folder of recordings; no video or audio is opened until it is needed.

    Parameters
    ----------
    root
        A session folder (see `PublishedSession`), or what another reader of videos recognises.
    fps_hz
        True frame rate of all its videos, where their containers' is wrong: times then count from
        it. It goes before what the session file says. None for what that and the containers say.

    Returns
    -------
    Session
        Recordings named ``<texture>/<speed>``, ``<texture>/<speed>/<repetition>`` or by their id,
        by texture in natural order, then by speed.

    Raises
    ------
    InputError
        If the folder is missing or unreadable, holds no condition, has a condition whose
        folder is not named by a speed, its grid has a hole that the session file does not
        declare, or some conditions have a video (or audio) and others have none.
    """
    found = data_set_of(root)
    found = found if found.extracted_first else PublishedSession(root)
    with in_a_sentence(str(root)):
        session = (found if fps_hz is None else found.at_rate(fps_hz)).scan()
    if not isinstance(session, Session):
        raise InputError(f"{root}: expected recordings to extract, found {type(session).__name__}")
    return session


def source_of(wanted: str | Path | DataSet) -> str:
    """Return what `data_set_of` finds it by again; of an object its class and path, if it can."""
    if not isinstance(wanted, DataSet) or type(wanted) in readers().values():
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

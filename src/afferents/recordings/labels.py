"""What a file next to the data says of each of its files: its texture, speed and conditions."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from afferents.errors import InputError, reading
from afferents.recordings.description import Labels
from afferents.recordings.tables import read_texts

Row = Mapping[str, str]
"""By what it says: texture, speed, or the name of a condition."""


def read_labels(path: Path, labels: Labels) -> dict[str, Row]:
    """Read what a file says, by the path of the file that it says it of.

    Parameters
    ----------
    path
        A CSV with names of columns, or JSON: a list of objects, or an object by file.

    Raises
    ------
    InputError
        If it can't be read, lacks a column, leaves one empty, or has two rows of one file.
    """
    found: dict[str, Row] = {}
    for where, row in _rows(path, labels):
        missing = [one for one in (labels.name, *labels.columns.values()) if not row.get(one)]
        if missing:
            have = ", ".join(name for name, text in row.items() if text) or "nothing"
            raise InputError(
                f"{path}, {where}: expected '{missing[0]}', found {have}; fill it in, or say in "
                "[files.labels] what it is called"
            )
        name = Path(row[labels.name]).as_posix()
        if name in found:
            raise InputError(f"{path}, {where}: expected a row a file, found '{name}' twice")
        found[name] = {what: row[column] for what, column in labels.columns.items()}
    if not found:
        raise InputError(f"{path}: expected a row for each file of data, found none")
    return found


def _rows(path: Path, labels: Labels) -> Iterator[tuple[str, Row]]:
    """Yield where each row stands, and its texts by column."""
    if path.suffix.lower() != ".json":
        yield from ((f"line {number}", row) for number, row in read_texts(path))
        return
    with reading(path, "a JSON file of labels", OSError, ValueError):
        found = json.loads(path.read_text(encoding="utf-8-sig"))
    if isinstance(found, dict):
        found = [
            {labels.name: name, **(row if isinstance(row, dict) else {labels.texture: row})}
            for name, row in found.items()
        ]
    if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
        raise InputError(
            f"{path}: expected a list of objects, or an object by file, found another JSON"
        )
    for number, row in enumerate(found, start=1):
        texts = {str(k): "" if one is None else str(one).strip() for k, one in row.items()}
        yield f"row {number}", texts


def find_row(path: str, rows: Mapping[str, Row]) -> str | None:
    """Return under which name rows speak of a path: its own, without ending, or its last part."""
    whole = Path(path)
    names = (whole, whole.with_suffix(""), Path(whole.name), Path(whole.stem))
    return next((name.as_posix() for name in names if name.as_posix() in rows), None)

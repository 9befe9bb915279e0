"""Groups of a Zarr v3 store, as they lie on disk: which there are, and whether they are whole."""

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any

from afferents.core.documents import read_json
from afferents.core.errors import InputError
from afferents.core.files import PARTIAL_PREFIX

ROOT = "zarr.json"
"""What makes a folder a group or an array."""
_DEEPEST = 6
"""Levels of groups; the name of a recording has three parts or fewer as a rule."""


def is_group(path: Path) -> bool:
    """Tell whether a folder is a Zarr group, of whatever content."""
    return (path / ROOT).is_file()


def recording_groups(folder: Path, level: int = 1) -> Iterator[Path]:
    """Yield the groups that are recordings: all that only hold other groups are passed through."""
    for path in folder.iterdir():
        if not path.is_dir() or path.name.startswith(PARTIAL_PREFIX):
            continue
        if level < _DEEPEST and _holds_groups_alone(path):
            yield from recording_groups(path, level + 1)
        elif (path / ROOT).is_file():
            yield path


def _holds_groups_alone(path: Path) -> bool:
    """Tell whether a folder is no recording, by its attributes; what is damaged is taken for one.

    A recording that has lost its attributes still has arrays.
    """
    try:
        if (path / ROOT).is_file() and attributes_of(path):
            return False
        return not any(_is_array(metadata) for metadata in path.glob(f"*/{ROOT}"))
    except InputError:
        return False


def _is_array(metadata: Path) -> bool:
    return read_json(metadata, "a part of a Zarr store").get("node_type") == "array"


def require_all_chunks(group: Path) -> None:
    """Refuse a group that lost part of its arrays, as a copy that was cut off has: it reads as NaN.

    The files are looked for without opening the arrays, which takes as long again as reading them.

    Raises
    ------
    InputError
        If it did.
    """
    for metadata in sorted(group.glob(f"*/{ROOT}")):
        array = read_json(metadata, "a part of a Zarr store")
        if array["node_type"] == "array":
            chunks = _chunk_names(array)
            found = sum((metadata.parent / name).is_file() for name in chunks)
            if found < len(chunks):
                raise InputError(
                    metadata.parent,
                    f"{len(chunks)} chunks",
                    f"{found}",
                    "copy the store again, or remove the recording's folder and extract again",
                )


def _chunk_names(array: Mapping[str, Any]) -> list[str]:
    """Return the files of an array's chunks (or shards), from its Zarr v3 metadata."""
    along = array["chunk_grid"]["configuration"]["chunk_shape"]
    counts = (-(-size // chunk) for size, chunk in zip(array["shape"], along, strict=True))
    separator = array["chunk_key_encoding"].get("configuration", {}).get("separator", "/")
    numbers = product(*map(range, counts))
    return [separator.join(("c", *map(str, number))) for number in numbers]


def attributes_of(path: Path) -> dict[str, Any]:
    """Return the attributes of a group.

    Raises
    ------
    InputError
        If there is none, or it is damaged.
    """
    attributes = read_json(path / ROOT, "a Zarr group").get("attributes", {})
    if not isinstance(attributes, dict):
        raise InputError(path / ROOT, "a Zarr group with attributes", "others", "extract again")
    return attributes

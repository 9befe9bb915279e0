"""Whether a Zarr group on disk is whole: its attributes and its chunks."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from afferents.documents import read_json
from afferents.errors import InputError

ROOT = "zarr.json"
"""What makes a folder a group or an array."""


def is_group(path: Path) -> bool:
    """Return whether a folder is a Zarr group, of whatever content."""
    return (path / ROOT).is_file()


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
                    f"{metadata.parent}: expected {len(chunks)} chunks, found {found}; copy the "
                    "store again, or remove the recording's folder and extract again"
                )


def _chunk_names(array: Mapping[str, Any]) -> list[str]:
    """Return the files of an array's chunks (or shards), from its Zarr v3 metadata."""
    along = array["chunk_grid"]["configuration"]["chunk_shape"]
    counts = (-(-size // chunk) for size, chunk in zip(array["shape"], along, strict=True))
    separator = array["chunk_key_encoding"].get("configuration", {}).get("separator", "/")
    numbers = product(*map(range, counts))
    return [separator.join(("c", *map(str, number))) for number in numbers]


def read_attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a group.

    Raises
    ------
    InputError
        If there is none, or it is damaged.
    """
    attributes = read_json(path / ROOT, "a Zarr group").get("attributes", {})
    if not isinstance(attributes, dict):
        raise InputError(
            f"{path / ROOT}: expected a Zarr group with attributes, found others; extract again"
        )
    return attributes

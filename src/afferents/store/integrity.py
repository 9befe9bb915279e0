"""Whether responses on disk are whole and as they were written: chunks, attributes, digests.

A digest tells responses that have changed since. Each variable carries the SHA-256 of its values,
the recording the SHA-256 of everything else: its attributes, and the names, dims, types, sizes and
attributes of its variables. So what is small is checked whenever a store is opened, and values when
they are read.
"""

import hashlib
import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

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
            along = array["chunk_grid"]["configuration"]["chunk_shape"]  # or of shards
            counts = (-(-size // n) for size, n in zip(array["shape"], along, strict=True))
            separator = array["chunk_key_encoding"].get("configuration", {}).get("separator", "/")
            numbers = product(*map(range, counts))
            chunks = [separator.join(("c", *map(str, number))) for number in numbers]
            found = sum((metadata.parent / name).is_file() for name in chunks)
            if found < len(chunks):
                raise InputError(
                    f"{metadata.parent}: expected {len(chunks)} chunks, found {found}; copy the "
                    "store again, or remove the recording's folder and extract again"
                )


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


DIGEST, VALUES = "digest", "sha256"
"""Attribute of a recording, and of each of its variables."""
_SMALL = 1 << 20
"""Values of up to this many bytes are checked at once."""


def sealed(responses: xr.Dataset) -> xr.Dataset:
    """Return responses that carry their digest."""
    named = responses.copy()
    for name, variable in named.variables.items():
        named[name].attrs = {**variable.attrs, VALUES: _hash_values(variable)}
    return named.assign_attrs({DIGEST: _hash_description(named)})


def require_described(responses: xr.Dataset, where: Path | str) -> None:
    """Refuse a recording whose labels or form have changed since it was written.

    Raises
    ------
    InputError
        If they have, or if it carries no digest.
    """
    if responses.attrs.get(DIGEST) != _hash_description(responses):
        raise InputError(
            f"{where}: expected responses as they were extracted, found others (their digest says "
            "so); extract again"
        )


def require_small_values(responses: xr.Dataset, where: Path | str) -> None:
    """Refuse a recording whose coordinates or other small variables have changed.

    What is read is not kept: of many short recordings it would be the whole store.

    Raises
    ------
    InputError
        Naming the first.
    """
    for name, variable in responses.variables.items():
        if variable.nbytes <= _SMALL:
            require_values(variable.copy(deep=False), f"{where}: {name}")


def require_values(variable: xr.Variable | xr.DataArray, where: Path | str) -> None:
    """Refuse a variable, read whole, whose values have changed since they were written.

    Raises
    ------
    InputError
        If they have.
    """
    expected = variable.attrs.get(VALUES)
    if expected is not None and expected != _hash_values(variable):
        raise InputError(
            f"{where}: expected values as they were extracted, found others (their digest says "
            "so); remove the recording's folder and extract again"
        )


def values_digest(responses: xr.Dataset, name: str) -> str | None:
    """Return the digest of a variable's values, without reading them; None where there is none."""
    return str(responses[name].attrs[VALUES]) if VALUES in responses[name].attrs else None


def _hash_values(variable: xr.Variable | xr.DataArray) -> str:
    values = variable.values
    if values.dtype.kind in "OUST":  # names: their type depends on who reads them
        content = json.dumps([str(name) for name in values.flat]).encode()
    else:
        content = np.ascontiguousarray(values).tobytes()
    return hashlib.sha256(content).hexdigest()


def _hash_description(responses: xr.Dataset) -> str:
    variables = {
        str(name): [
            list(map(str, variable.dims)),
            list(variable.shape),
            "name" if variable.dtype.kind in "OUST" else variable.dtype.str,
            variable.attrs,
        ]
        for name, variable in responses.variables.items()
    }
    attributes = {name: value for name, value in responses.attrs.items() if name != DIGEST}
    # NumPy values as JSON holds them, which is what comes back from a store.
    text = json.dumps([attributes, variables], sort_keys=True, default=lambda one: one.tolist())
    return hashlib.sha256(text.encode()).hexdigest()

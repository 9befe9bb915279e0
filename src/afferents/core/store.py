"""The store of extracted responses: one Zarr v3 store a session, a group a recording.

A recording is written under a temporary name and renamed when whole, so a group that is there
is complete. Plain xarray reads it: ``xarray.open_zarr("OUT.zarr", group="3/50")``.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import xarray as xr
import zarr

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.files import PARTIAL_PREFIX, read_json, require_same_config, write_aside
from afferents.core.recording import natural_order
from afferents.core.responses import Responses, check_responses

FORMAT, SCHEMA = "afferents responses", 1
FRAMES_A_CHUNK, AUDIO_SAMPLES_A_CHUNK = 1024, 1 << 18
_ROOT = "zarr.json"


def create_store(store: Path, config: Mapping[str, Any]) -> None:
    """Create an empty store, or check that the one there was begun with the same `config`.

    Raises
    ------
    InputError
        If something else stands there, or a store of another configuration.
    """
    if (store / _ROOT).is_file():
        require_same_config(store, "responses", store_config(store), config)
        return
    if store.exists():
        raise InputError(store, "a new store", "something else of that name", "choose another name")
    _write_group(store, {"format": FORMAT, "schema": SCHEMA, "config": dict(config)})


def create_parents(store: Path, names: Iterable[str]) -> None:
    """Create the groups that recordings of these names stand in, before several are written."""
    for parent in sorted({(store / name).parent for name in names}):
        if not (parent / _ROOT).is_file():
            _write_group(parent, {})


def store_config(store: Path) -> dict[str, Any]:
    """Return the configuration that a store was extracted with.

    Raises
    ------
    InputError
        If there is no store, or one of another format.
    """
    if not (store / _ROOT).is_file():
        raise InputError(store, "a store written by 'afferents extract'", "none", "extract first")
    attributes = _attributes(store)
    if (attributes.get("format"), attributes.get("schema")) != (FORMAT, SCHEMA):
        found = f"format {attributes.get('format')!r}, schema {attributes.get('schema')}"
        raise InputError(store, f"format {FORMAT!r}, schema {SCHEMA}", found, "extract again")
    config: dict[str, Any] = attributes["config"]
    return config


def write_responses(store: Path, responses: Responses) -> None:
    """Write the responses of one recording as the group of its name, whole or not at all."""
    target = store / responses.attrs["name"]
    create_parents(store, [responses.attrs["name"]])
    write_group(target, check_responses(responses, target))


def write_group(target: Path, dataset: xr.Dataset) -> None:
    """Write a dataset as a Zarr v3 group, whole or not at all."""
    with write_aside(target) as partial:
        _variable_strings(dataset).to_zarr(
            partial,
            zarr_format=3,
            consolidated=False,
            write_empty_chunks=True,  # so that one that is missing has been lost
            encoding={name: _encoding(dataset[name]) for name in dataset.data_vars},
        )


def has_responses(store: Path, name: str, source_checksum: str) -> bool:
    """Tell whether the store holds this recording, from the same source files.

    Raises
    ------
    InputError
        If it holds the recording but from other files.
    """
    if not (store / name / _ROOT).is_file():
        return False
    if _attributes(store / name).get("checksum") != source_checksum:
        raise InputError(
            store / name,
            "responses of the recording as it is now",
            "responses of other files",
            "choose another name for the store",
        )
    return True


def stored_attributes(store: Path, names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the attributes of those of these recordings that the store holds."""
    there = (name for name in names if (store / name / _ROOT).is_file())
    return {name: _attributes(store / name) for name in there}


def open_responses(store: Path) -> list[Responses]:
    """Open all recordings of a store, lazily, in order of texture and speed.

    Raises
    ------
    InputError
        If there is no store, no recording in it, or one that is not as documented.
    """
    store_config(store)
    groups = sorted(
        path.parent
        for path in store.glob(f"*/*/{_ROOT}")
        if not path.parent.name.startswith(PARTIAL_PREFIX)
    )
    opened = [_open(group) for group in groups]
    if not opened:
        raise InputError(store, "at least one recording", "none", "extract again")
    return sorted(opened, key=lambda r: (natural_order(r.attrs[dims.TEXTURE]), r.attrs[dims.SPEED]))


def _open(group: Path) -> Responses:
    try:
        responses = xr.open_zarr(group, consolidated=False, chunks=None)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            group, "responses that can be read", f"{error}", "remove the folder and extract again"
        ) from error
    _require_all_chunks(group)
    return check_responses(responses, group)


def _require_all_chunks(group: Path) -> None:
    """Refuse a group that lost part of its arrays, as a copy that was cut off has: it reads as NaN.

    Raises
    ------
    InputError
        If it did.
    """
    for name, array in zarr.open_group(group, mode="r", use_consolidated=False).arrays():
        missing = array.nchunks - array.nchunks_initialized
        if missing:
            raise InputError(
                group / name,
                f"{array.nchunks} chunks",
                f"{array.nchunks_initialized}",
                "copy the store again, or remove the recording's folder and extract again",
            )


def _attributes(path: Path) -> dict[str, Any]:
    attributes: dict[str, Any] = read_json(path / _ROOT, "a Zarr group").get("attributes", {})
    return attributes


def _variable_strings(responses: xr.Dataset) -> xr.Dataset:
    """Names of variable length: Zarr v3 specifies no type for those of fixed length."""
    fixed = [name for name in responses.variables if responses[name].dtype.kind == "U"]
    return responses.assign_coords({name: responses[name].astype(object) for name in fixed})


def _encoding(variable: xr.DataArray) -> dict[str, Any]:
    first = variable.dims[0]
    along = {dims.TIME: FRAMES_A_CHUNK, dims.AUDIO_TIME: AUDIO_SAMPLES_A_CHUNK}.get(str(first))
    whole = variable.shape
    chunks = (min(along, whole[0]), *whole[1:]) if along else whole
    return {"chunks": tuple(max(1, size) for size in chunks)}


def _write_group(path: Path, attributes: Mapping[str, Any]) -> None:
    zarr.create_group(path, zarr_format=3, attributes=dict(attributes))

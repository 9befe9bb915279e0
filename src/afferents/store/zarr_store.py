"""The store of extracted responses: one Zarr v3 store a session, a group a recording.

A recording is written under a temporary name and renamed when whole, so a group that is there
is complete; its digest (`store.integrity`) tells one that has changed since. Plain xarray reads it:
``xarray.open_zarr("OUT.zarr", group="3/50")``.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import xarray as xr
from pydantic import BaseModel

from afferents import dims, documents, files
from afferents.errors import InputError, reading, then
from afferents.quality.image import ImageQuality
from afferents.store import integrity
from afferents.store.integrity import ROOT
from afferents.store.recording import natural_order
from afferents.store.responses import Responses, check_responses

FORMAT, SCHEMA = "afferents responses", 2
TRACKS = "afferents tracks"
"""Format of a store of one video's tracks."""
_MAY_BE_NAN = (dims.SPEED, *(field.name for field in fields(ImageQuality)))
"""Attributes that are null on disk where they are not known: JSON has no NaN."""
FRAMES_A_CHUNK, AUDIO_SAMPLES_A_CHUNK = 1024, 1 << 18
FOLLOWS = ("declared", "recordings", "sensors")
"""What of a store's configuration follows the session as it is now: a session.json may be mended
and recordings added without another store; what was made under another declaration is made anew."""


class _Config(BaseModel):
    """What the configuration of a store must say; the rest is not checked."""

    recordings: list[str]


def create_store(store: Path, config: Mapping[str, Any]) -> None:
    """Create an empty store, or check that the one there was begun with the same `config`.

    Raises
    ------
    InputError
        If something else stands there, or a store that holds recordings of another configuration,
        or such that are not the session's.
    """
    if integrity.is_group(store):
        earlier = store_config(store)
        there = {name for name in earlier["recordings"] if (store / name / ROOT).is_file()}
        lost = sorted(there.difference(config["recordings"]))
        if lost:
            found = f"responses of {', '.join(lost[:3])}, which it does not have"
            raise InputError(
                f"{store}: expected responses of this session, found {found}; choose another name"
            )
        if there:  # a store without any is as good as new
            if "sensor" in earlier and "sensor" in config:
                has, wanted = earlier["sensor"], json.loads(json.dumps(config["sensor"]))
                if differs := files.first_difference(has, wanted):
                    which = f" (another {differs[0]})" if has["name"] == wanted["name"] else ""
                    raise InputError(
                        f"{store}: expected responses of the requested sensor, '{wanted['name']}', "
                        f"found those of '{has['name']}'{which}; choose another name for the "
                        "store, remove this one, or give that sensor"
                    )
            before, now = (
                {name: value for name, value in one.items() if name not in FOLLOWS}
                for one in (earlier, config)
            )
            files.require_same_config(store, "responses", before, now)
        if earlier == config:
            return
    else:
        files.require_free(store, files.holds_only())
    _write_group(store, {"format": FORMAT, "schema": SCHEMA, "config": dict(config)})


def create_parents(store: Path, names: Iterable[str]) -> None:
    """Create the groups that recordings of these names stand in, before several are written."""
    inside = {parent for name in names for parent in Path(name).parents} - {Path()}
    for parent in sorted(store / name for name in inside):
        if not (parent / ROOT).is_file():
            _write_group(parent, {})


def remove_empty(store: Path, names: Iterable[str]) -> None:
    """Remove the groups of a store in which no recording of these names stands, and an empty store.

    Other files in the store's folder stay.
    """
    whole = [name for name in names if (store / name / ROOT).is_file()]
    used = {Path(), *map(Path, whole)}.union(*(Path(name).parents for name in whole))
    for parent in {parent for name in names for parent in Path(name).parents} - used:
        files.remove(store / parent)
    if not whole:
        files.remove(store / ROOT)


def store_config(store: Path) -> dict[str, Any]:
    """Return the configuration that a store was extracted with.

    Raises
    ------
    InputError
        If there is no store, or one of another format.
    """
    if not integrity.is_group(store):
        raise InputError(
            f"{store}: expected a store written by 'afferents extract', found none; extract first"
        )
    attributes = integrity.read_attributes(store)
    if attributes.get("format") == TRACKS:
        raise InputError(
            f"{store}: expected a store written by 'afferents extract', found the tracks of one "
            "video; put the video into a folder, and type 'afferents init FOLDER' and 'afferents "
            "extract FOLDER STORE'"
        )
    if (attributes.get("format"), attributes.get("schema")) != (FORMAT, SCHEMA):
        found = f"format {attributes.get('format')!r}, schema {attributes.get('schema')!r}"
        do = "extract the session again, into a store of another name"
        raise InputError(
            f"{store}: expected format {FORMAT!r}, schema {SCHEMA}, found {found}{then(do)}"
        )
    config: dict[str, Any] = attributes.get("config", {})
    documents.as_form(
        config, _Config, store / ROOT, "the configuration of a store", "extract again"
    )
    return config


def is_tracks(path: Path) -> bool:
    """Return whether a folder is a store of one video's tracks."""
    return bool(attributes_there(path).get("format") == TRACKS)


def write_responses(store: Path, responses: Responses) -> None:
    """Write the responses of one recording as the group of its name, whole or not at all."""
    target = store / responses.attrs["name"]
    create_parents(store, [responses.attrs["name"]])
    write_group(target, integrity.sealed(check_responses(responses, target)))


def write_group(target: Path, dataset: xr.Dataset) -> None:
    """Write a dataset as a Zarr v3 group, whole or not at all; it replaces another group."""
    with files.write_aside(target, replaces=_holds_arrays) as partial:
        # Names of variable length: Zarr v3 specifies no type for those of fixed length.
        fixed = [name for name in dataset.variables if dataset[name].dtype.kind == "U"]
        named = dataset.assign_coords({name: dataset[name].astype(object) for name in fixed})
        known = {name: dataset.attrs[name] for name in _MAY_BE_NAN if name in dataset.attrs}
        unknown = [name for name, value in known.items() if value != value]
        named.assign_attrs(dict.fromkeys(unknown)).to_zarr(
            partial,
            zarr_format=3,
            consolidated=False,
            write_empty_chunks=True,  # so that one that is missing has been lost
            encoding={name: _choose_chunks(dataset[name]) for name in dataset.data_vars},
        )
        if not (partial / ROOT).is_file():  # it was removed while it was being written
            raise InputError(
                f"{target}: expected to be written undisturbed, found parts of it removed meanwhile"
            )
        integrity.require_all_chunks(partial)


def _holds_arrays(folder: Path) -> bool:
    """Return whether a folder is a group, whole or not: arrays and metadata, nothing else."""
    return all(
        entry.name == ROOT or (entry.is_dir() and {p.name for p in entry.iterdir()} <= {ROOT, "c"})
        for entry in folder.iterdir()
    )


class OtherFilesError(InputError):
    """Responses in a store that were made of other files than are now the recording's."""


def require_same_files(store: Path, name: str, checksum: str) -> None:
    """Refuse responses of other files, if the store holds the recording.

    Raises
    ------
    OtherFilesError
        If it does.
    """
    if attributes_there(store / name).get("checksum", "") not in ("", checksum):
        raise OtherFilesError(
            f"{store / name}: expected responses of the recording as it is now, found responses of "
            "other files; choose another name for the store"
        )


def attributes_there(group: Path) -> dict[str, Any]:
    """Return the attributes of a group; none where it is missing or damaged."""
    with suppress(InputError):
        return integrity.read_attributes(group)
    return {}


def is_whole(store: Path, name: str) -> bool:
    """Return whether a store holds a recording that can be opened."""
    with suppress(InputError):
        _open(store, name)
        return True
    return False


def recordings_there(store: Path) -> int:
    """Return how many of its recordings a store holds whole; 0 where there is none yet."""
    if not integrity.is_group(store):
        return 0
    return sum(is_whole(store, name) for name in store_config(store)["recordings"])


def holds_all(store: Path) -> bool:
    """Return whether a store holds all of its session; False where there is none yet."""
    n = recordings_there(store)
    return n > 0 and n == len(store_config(store)["recordings"])


def stored_attributes(store: Path, names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the attributes of those of these recordings that the store holds."""
    there = (name for name in names if (store / name / ROOT).is_file())
    return {name: integrity.read_attributes(store / name) for name in there}


def open_responses(store: str | Path) -> list[Responses]:
    """Open all recordings of a folder that `extract` has written, lazily, by texture and speed.

    Returns
    -------
    list of xarray.Dataset
        A recording each, with its `texture` and `speed_mm_s` (mm/s) in the attributes: `sa1` and
        `ra1` (time, marker), px and px/frame, `ra2` (audio_time, channel), and the markers'
        `position` (time, marker, space), px; see `afferents.store.responses`.

    Raises
    ------
    InputError
        If there is no store, no recording in it, or one that is not as documented.
    """
    store = Path(store)
    names = sorted(store_config(store)["recordings"], key=Path)
    opened = [_open(store, name) for name in names if (store / name / ROOT).is_file()]
    known = {store / name for name in names}
    folders = {one for path in known for one in path.parents if one.is_relative_to(store)}
    for group in sorted(path.parent for one in folders for path in one.glob(f"[!.]*/{ROOT}")):
        if group not in known | folders:  # such as one that was copied by hand
            expected = "a recording that the store names, as 'extract' writes it"
            raise InputError(f"{group}: expected {expected}, found another; remove it")
    if not opened:
        raise InputError(f"{store}: expected at least one recording, found none; extract again")

    def place(one: Responses) -> tuple[tuple[float, str], float, str]:  # unknown speeds come last
        speed = float(one.attrs[dims.SPEED])
        speed = math.inf if math.isnan(speed) else speed
        return natural_order(one.attrs[dims.TEXTURE]), speed, one.attrs["name"]

    return sorted(opened, key=place)


def open_whole(store: str | Path) -> list[Responses]:
    """Open all recordings of a store, as `open_responses`, and refuse half of one.

    Raises
    ------
    InputError
        As `open_responses`, and if a recording of the session is not in the store.
    """
    opened, config = open_responses(store), store_config(Path(store))
    require_all(store, config, opened, ", without what can't be extracted")
    return opened


def require_all(
    where: str | Path, config: Mapping[str, Any], there: Sequence[Responses], otherwise: str
) -> None:
    """Refuse responses if the session of their configuration has more.

    Raises
    ------
    InputError
        Naming the first that are missing; `otherwise` follows on what to do.
    """
    if missing := missing_from(config, there):
        raise InputError(
            f"{where}: expected the {len(missing) + len(there)} recordings of its session, found "
            f"{len(there)} ({', '.join(missing[:5])} missing); extract again{otherwise}"
        )


def missing_from(config: Mapping[str, Any], there: Sequence[Responses]) -> list[str]:
    """Return which recordings of the session that a configuration names are not there."""
    names = {one.attrs["name"] for one in there}
    return [name for name in config.get("recordings", []) if name not in names]


def _open(store: Path, name: str) -> Responses:
    group = store / name
    documents.read_json(group / ROOT, "a part of a Zarr store")  # what zarr would choke on
    with reading(group, "responses that can be read", do="remove the folder and extract again"):
        integrity.require_all_chunks(group)
        responses = xr.open_zarr(group, consolidated=False, chunks=None)
        unknown = [name for name in _MAY_BE_NAN if responses.attrs.get(name, 0) is None]
        responses = responses.assign_attrs(dict.fromkeys(unknown, math.nan))
        checked = check_responses(responses, group)
        integrity.require_described(checked, group)
        integrity.require_small_values(checked, group)
    if checked.attrs["name"] != name:
        found = f"those of '{checked.attrs['name']}'"
        raise InputError(
            f"{group}: expected the responses of '{name}', found {found}; extract again"
        )
    return checked


def _choose_chunks(variable: xr.DataArray) -> dict[str, Any]:
    first = variable.dims[0]
    along = {dims.TIME: FRAMES_A_CHUNK, dims.AUDIO_TIME: AUDIO_SAMPLES_A_CHUNK}.get(str(first))
    whole = variable.shape
    chunks = (min(along, whole[0]), *whole[1:]) if along else whole
    return {"chunks": tuple(max(1, size) for size in chunks)}


def _write_group(path: Path, attributes: Mapping[str, Any]) -> None:
    """Write what makes a folder a group, or give one other attributes, at one stroke."""
    group = {"attributes": attributes, "zarr_format": 3, "node_type": "group"}
    with files.write_aside(path / ROOT) as partial:
        partial.write_text(json.dumps(group, indent=2), encoding="utf-8")

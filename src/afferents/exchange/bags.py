"""Recordings as ROS 2 bags in MCAP files."""

import heapq
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.errors import InputError
from afferents.exchange.bag_tracks import (
    QUALITY,
    Stamped,
    drum,
    markers,
    percepts,
    pictures,
    sound_of_file,
    sound_of_store,
)
from afferents.files import Place, write_aside, write_json
from afferents.outputs import require_new_folder
from afferents.progress import Progress
from afferents.recordings.ros_messages import Messages, typestore
from afferents.recordings.session import read_session
from afferents.store.drum_path import logged_way, way_in
from afferents.store.integrity import is_group
from afferents.store.recording import Recording
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses
from afferents.version import __version__

ABOUT = "export.json"
"""Beside the bags: what was exported."""


@dataclass(frozen=True)
class McapExport:
    """What is exported.

    Attributes
    ----------
    source
        A session or a store.
    out
        Folder to write: in it a bag a recording.
    store
        Of a session: the store that was extracted from it, for its markers and responses.
    recordings
        Names of those that are wanted; none for all.
    quality
        Of the JPEGs, 1 to 100, where the camera gave none; its own go into the bag as they are.
    percepts
        What ``afferents live --json`` said of the one recording that is wanted.
    """

    source: Path
    out: Path
    store: Path | None = None
    recordings: Sequence[str] = ()
    quality: int = QUALITY
    percepts: Path | None = None


def write_bags(wanted: McapExport, progress: Progress) -> list[Path]:
    """Write a bag for each recording.

    Returns
    -------
    Their folders, each with an MCAP file and the ``metadata.yaml`` of rosbag2.

    Raises
    ------
    InputError
        If the extra ``mcap`` is missing, there is no such session, store or recording, or `out`
        is there already.
    """
    types = typestore()
    require_new_folder(wanted.out, "a new folder for bags")
    if not 1 <= wanted.quality <= 100:
        raise InputError(f"--quality: expected a number from 1 to 100, found {wanted.quality}")
    parts = _parts(wanted)
    if wanted.percepts is not None and len(parts) != 1:
        expected = "one recording, named with --recording"
        raise InputError(f"--percepts: expected {expected}, found {len(parts)}")
    written = []
    with write_aside(wanted.out) as partial:
        partial.mkdir(parents=True)
        for name, streams in progress.track(parts.items(), "exporting", len(parts)):
            folder = name.replace("/", "_").replace(":", "_")
            _write(partial / folder, types, streams, name)
            written.append(wanted.out / folder)
        write_json(partial / ABOUT, {"afferents": __version__, "recordings": sorted(parts)})
    return written


def _parts(wanted: McapExport) -> dict[str, list[Any]]:
    """Return what is to be written of each recording: functions that yield stamped messages."""
    if is_group(wanted.source):
        if wanted.store is not None:
            raise InputError(
                f"--store: expected a session beside it, found the store {wanted.source}"
            )
        stored = _named(wanted, {str(r.attrs["name"]): r for r in open_responses(wanted.source)})
        parts = {name: _of_store(responses, alone=True) for name, responses in stored.items()}
    else:
        session = read_session(wanted.source)
        found = _named(wanted, {one.name: one for one in session.recordings})
        responses = _responses(wanted.store, found)
        parts = {name: _of_recording(one, wanted.quality) for name, one in found.items()}
        for name, one in responses.items():
            parts[name] += _of_store(one, alone=False)
    if wanted.percepts is not None:
        for streams in parts.values():
            streams.append(lambda make: percepts(make, wanted.percepts))
    return parts


def _named(wanted: McapExport, found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the recordings that are wanted."""
    for name in wanted.recordings:
        if name not in found:
            some = ", ".join(list(found)[:5])
            raise InputError(
                f"--recording: expected one of {wanted.source} ({some}, ...), found '{name}'"
            )
    return {name: one for name, one in found.items() if name in (wanted.recordings or found)}


def _responses(store: Path | None, found: Mapping[str, Recording]) -> dict[str, Responses]:
    if store is None:
        return {}
    stored = {str(one.attrs["name"]): one for one in open_responses(store)}
    if lacking := [name for name in found if name not in stored]:
        expected = f"the recording '{lacking[0]}', extracted from the session"
        raise InputError(
            f"{store}: expected {expected}, found none; give the store of that session"
        )
    return {name: stored[name] for name in found}


def _of_recording(recording: Recording, quality: int) -> list[Any]:
    streams: list[Any] = []
    if recording.video is not None:
        streams.append(lambda make: pictures(make, recording.video, quality))
    if recording.audio is not None:
        streams.append(lambda make: sound_of_file(make, recording.audio))
        folder = Path(recording.audio.path).parent
        streams.append(lambda make: drum(make, logged_way(folder)))
    return streams


def _of_store(responses: Responses, alone: bool) -> list[Any]:
    streams: list[Any] = [lambda make: markers(make, responses)]
    if alone:
        streams.append(lambda make: sound_of_store(make, responses))
        streams.append(lambda make: drum(make, way_in(responses)))
    return streams


def _write(path: Path, types: Any, streams: Sequence[Any], name: str) -> None:
    """Write a bag; its messages in order of time."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    make = Messages(types)
    merged: Iterator[Stamped] = heapq.merge(
        *(stream(make) for stream in streams), key=lambda message: message.at_ns
    )
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        bag.set_custom_data("afferents", json.dumps({"recording": name, "version": __version__}))
        topics: dict[str, Any] = {}
        for message in merged:
            if message.topic not in topics:
                topics[message.topic] = bag.add_connection(
                    message.topic, message.type, typestore=types
                )
            bag.write(topics[message.topic], message.at_ns, message.data)


def export_mcap(
    source: Place,
    out: Place,
    store: Place | None = None,
    recordings: str | Sequence[str] = (),
    quality: int = 95,
    percepts: Place | None = None,
    quiet: bool = False,
) -> list[Path]:
    """Write recordings as ROS 2 bags in MCAP files, for Foxglove, rerun and ``ros2 bag play``.

    A bag holds the camera's pictures as JPEGs, the sound, the drum's way and speed, and, of a
    store, the markers (drawn on the picture too), SA-I and RA-I. Times count from the recording's
    zero. Needs the extra ``mcap``; no ROS.

    Parameters
    ----------
    source
        A session, or a store, which has no pictures.
    out
        Folder to write; in it a folder a recording, with an ``.mcap`` file.
    store
        Of a session: the store that was extracted from it.
    recordings
        Names such as ``4/60``; none for all.
    quality
        Of JPEGs, 1 to 100. Those that the camera gave go into the bag byte for byte.
    percepts
        File with what ``afferents live --json`` said of the one recording that is named.
    quiet
        Whether no progress is shown.

    Returns
    -------
    list of Path
        The bags.

    Raises
    ------
    InputError
        If there is no such session, store or recording, the package is missing, or `out` is there
        already.

    Examples
    --------
    >>> export_mcap("session", "bags", store="responses.zarr", recordings="4/60")
    [PosixPath('bags/4_60')]
    """
    named = recordings.split(",") if isinstance(recordings, str) else list(recordings)
    wanted = McapExport(
        Path(source), Path(out), None if store is None else Path(store),
        tuple(name for name in named if name), quality,
        None if percepts is None else Path(percepts),
    )  # fmt: skip
    with Progress(quiet) as progress:
        return write_bags(wanted, progress)

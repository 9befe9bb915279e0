"""From an extracted store to an NWB file, whole or not at all."""

import json
import warnings
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from afferents import choices, dims, files
from afferents.errors import InputError, reading
from afferents.files import Place
from afferents.neuro.nwb import content
from afferents.plugins import import_extra
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.session import match_recordings
from afferents.spikes.artificial import artificial_spikes
from afferents.store import integrity, zarr_store
from afferents.store.responses import Responses, textures_of
from afferents.version import __version__

_SCRIPT = "afferents export-nwb"
"""In a file of ours, by which it is known as one."""
_CLOCK = (
    "All times are on one clock that counts from the beginning of the first recording. Recordings "
    f"follow one another on it, at least {content.GAP_S:g} s apart, by texture and speed: in "
    "which order and at which time of day they were made is not known. "
)
_UNITS = (
    "Units are artificial: neuron models that the fingertip's responses drive (SA and RA by the "
    "markers in its camera's picture, PC by the vibration). No nerve fibre was recorded."
)


def export_nwb(
    store: Place,
    out: Place,
    session: Place | None = None,
    model: str = "izhikevich",
    seed: int = 0,
    classes: str | Sequence[str] = "SA,RA,PC",
    sound: bool = True,
    markers: bool = True,
    start_time: str | datetime | None = None,
    force: bool = False,
    quiet: bool = False,
) -> Path:
    """Write a store as an NWB file: spikes of artificial afferents, trials, sound and markers.

    Recordings follow one another on the session's clock. Needs the extra ``nwb``.

    Parameters
    ----------
    store
        A store that 'extract' wrote.
    out
        File to write, such as session.nwb.
    session
        Session folder that the store was extracted from, to name its videos in the file.
    model
        Model of a unit: izhikevich, or lif (leaky integrate-and-fire).
    seed
        Draws how units of a class differ.
    classes
        Classes of units, some of SA, RA and PC.
    sound
        Write the vibration, too.
    markers
        Write the marker tracks, too.
    start_time
        When the session began, such as 2026-03-31T09:30+02:00; without a zone it is UTC (default:
        when the store was written).
    force
        Overwrite what this command wrote there before (nothing else).
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputError
        If there is no store or half of one, it was extracted from another session, the packages are
        missing, or another file is there already.

    Examples
    --------
    >>> export_nwb("responses.zarr", "session.nwb", session="session")
    PosixPath('session.nwb')
    """
    pynwb = import_extra("nwb", "export-nwb", "pynwb", "ndx_pose", "ndx_sound")
    import h5py

    store, out = Path(store), Path(out)
    choices.require_number("--seed", seed, 0, choices.LARGEST_SEED)
    if out.suffix != ".nwb":
        raise InputError(f"{out}: expected a name that ends in .nwb, found '{out.name}'")
    reads = [store] if session is None else [store, Path(session)]
    files.require_free(out, _is_exported, force=force, reads=reads)
    what = "a date and time such as 2026-03-31T09:30+02:00"
    with reading("--start-time", what, ValueError):
        began = datetime.fromisoformat(start_time) if isinstance(start_time, str) else start_time
    if began is not None and began.tzinfo is None:
        began = began.replace(tzinfo=UTC)
    recordings = zarr_store.open_whole(store)
    numbers = {one.sizes[dims.MARKER] for one in recordings if dims.POSITION in one}
    if markers and len(numbers) > 1:  # there is one series a marker
        found = " and ".join(map(str, sorted(numbers)))
        raise InputError(
            f"{store}: expected as many markers in each recording, found {found}; add --no-markers "
            "and --classes PC"
        )
    of_session = {} if session is None else match_recordings(read_session(session), recordings)
    placed = content.place_recordings(recordings)
    with Progress(quiet) as progress:
        read = progress.track(recordings, "spikes", len(recordings))
        spikes = artificial_spikes(read, model, seed, choices.words_in(classes))
        nwbfile = _make_file(store, out, recordings, began, f"{model}, seed {seed}")
        content.add_units(nwbfile, spikes, content.add_trials(nwbfile, spikes, placed))
        if of_session:
            content.add_videos(nwbfile, placed, of_session, out)
        if sound:
            content.add_sounds(nwbfile, placed)
        if markers:
            content.add_tracks(nwbfile, placed)
        with files.write_aside(out) as partial:
            # the temporary name has no .nwb, of which there is a warning
            with warnings.catch_warnings(action="ignore"), pynwb.NWBHDF5IO(str(partial), "w") as io:
                io.write(nwbfile)
            frame = 0
            with h5py.File(partial, "r+") as file:
                for one in progress.track(placed, "writing", len(placed)):
                    frame = content.write_values(file, one, frame)
    return out


def _make_file(
    store: Path, out: Path, recordings: Sequence[Responses], began: datetime | None, units: str
) -> Any:
    """Return an NWB file without data: what was done, with which sensor."""
    from pynwb import NWBFile
    from pynwb.file import Subject

    config = zarr_store.store_config(store)
    simulated = bool(config.get("declared", {}).get("simulated"))
    textures = textures_of(recordings)
    written = datetime.fromtimestamp((store / integrity.ROOT).stat().st_mtime, tz=UTC)
    nwbfile = NWBFile(
        session_description="A soft tactile fingertip slides over textures"
        f"{', simulated' if simulated else ''}. {_CLOCK}{_UNITS}",
        identifier=str(uuid4()),
        session_start_time=began or written,
        session_id=str(config.get("session", "")) or None,
        experiment_description=f"{len(recordings)} recordings of {len(textures)} textures: "
        f"{', '.join(textures)}.",
        protocol="The fingertip is pressed on a texture, which moves under it at a constant speed. "
        "A trial is the part of a recording at constant speed.",
        keywords=["touch", "texture", "tactile fingertip", "artificial afferents"],
        data_collection=json.dumps(config, default=str),
        notes=f"Units: {units}."
        + (" The session start is when the store was written." * (began is None)),
        source_script=f"{_SCRIPT} {store.name} {out.name}",
        source_script_file_name=_SCRIPT,
        was_generated_by=[["afferents", __version__]],
    )
    nwbfile.subject = Subject(
        subject_id="fingertip",
        description="A soft artificial fingertip; no animal, no person. Its age and sex mean "
        "nothing: archives of NWB files ask for them.",
        age="P0D",
        sex="O",
    )
    sensor = config.get("sensor", {})
    name = sensor.get("name") if isinstance(sensor, dict) else None
    nwbfile.create_device(
        name="fingertip",
        description=f"Soft fingertip with markers inside{f' ({name})' if name else ''}; the sensor "
        "file is in data_collection.",
    )
    nwbfile.create_device(
        name=content.CAMERA, description="Films the markers on the inside of the fingertip's skin."
    )
    return nwbfile


def _is_exported(path: Path) -> bool:
    """Return whether `export_nwb` wrote a file."""
    import h5py

    with suppress(OSError, KeyError), h5py.File(path, "r") as file:
        return bool(file["general/source_script"].attrs["file_name"] == _SCRIPT)
    return False

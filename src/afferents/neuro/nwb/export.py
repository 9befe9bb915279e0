"""From an extracted store to an NWB file, whole or not at all."""

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from afferents import dims
from afferents.errors import InputError
from afferents.files import Place, write_aside
from afferents.neuro.nwb.media import add_sounds, add_tracks, add_videos, fill
from afferents.neuro.nwb.tables import GAP_S, add_trials, add_units, laid_out
from afferents.outputs import require_free
from afferents.plugins import import_extra
from afferents.progress import Progress
from afferents.recordings.check import check_files
from afferents.recordings.session import read_session
from afferents.spikes.artificial import artificial_spikes
from afferents.spikes.population import Spikes
from afferents.store.integrity import ROOT
from afferents.store.recording import Recording
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses, store_config
from afferents.version import __version__

_SCRIPT = "afferents export-nwb"
"""In a file of ours, by which it is known as one."""
_CLOCK = (
    "All times are on one clock that counts from the beginning of the first recording. Recordings "
    f"lie one after another on it, at least {GAP_S:g} s apart, by texture and speed: in which "
    "order and at which time of day they were made is not known. "
)
_UNITS = (
    "Units are artificial: neuron models that the fingertip's responses drive (SA and RA by the "
    "markers in its camera's picture, PC by the vibration). No nerve fibre was recorded."
)


@dataclass(frozen=True)
class NwbExport:
    """What is written into an NWB file.

    Attributes
    ----------
    store, out
        The store, and the file to write, which ends in ``.nwb``.
    session
        Folder that the store was extracted from, whose videos are named in the file; None for no
        videos.
    model, seed, classes
        Of the units; see `artificial_spikes`.
    sound, markers
        Whether the vibration and the marker tracks are written too.
    start_time
        When the session began; None for when the store was written.
    """

    store: Path
    out: Path
    session: Path | None = None
    model: str = "izhikevich"
    seed: int = 0
    classes: Sequence[str] = ("SA", "RA", "PC")
    sound: bool = True
    markers: bool = True
    start_time: datetime | None = None


def write_nwb(wanted: NwbExport, progress: Progress, force: bool = False) -> Spikes:
    """Write a store as an NWB file.

    Parameters
    ----------
    force
        Whether a file that was exported there before may be replaced.

    Returns
    -------
    The spikes that it holds.

    Raises
    ------
    InputError
        If the packages are missing, the store or the session is not what it should be, or `out` is
        not free.
    """
    import_extra("nwb", "export-nwb", "pynwb", "ndx_pose", "ndx_sound")
    out = wanted.out
    if out.suffix != ".nwb":
        raise InputError(f"{out}: expected a name that ends in .nwb, found '{out.name}'")
    reads = [path for path in (wanted.store, wanted.session) if path is not None]
    require_free(out, "an NWB file", _is_exported, force=force, reads=reads)
    config, recordings = store_config(wanted.store), open_responses(wanted.store)
    if wanted.markers:
        _require_one_layout(wanted.store, recordings)
    of_session = _session(wanted, recordings)
    spikes = artificial_spikes(
        progress.track(recordings, "spikes", len(recordings)),
        wanted.model,
        wanted.seed,
        wanted.classes,
    )
    _write(wanted, config, recordings, of_session, spikes, progress)
    return spikes


def _write(
    wanted: NwbExport,
    config: dict[str, Any],
    recordings: Sequence[Responses],
    of_session: dict[str, Recording],
    spikes: Spikes,
    progress: Progress,
) -> None:
    import h5py
    from pynwb import NWBHDF5IO

    laid = laid_out(recordings)
    nwbfile = _described(wanted, config, recordings)
    camera = nwbfile.create_device(
        name="camera", description="Films the markers on the inside of the fingertip's skin."
    )
    add_units(nwbfile, spikes, add_trials(nwbfile, spikes, laid))
    if of_session:
        add_videos(nwbfile, laid, of_session, wanted.out, camera)
    if wanted.sound:
        add_sounds(nwbfile, laid)
    if wanted.markers:
        add_tracks(nwbfile, laid, camera)
    with write_aside(wanted.out) as partial:
        # the temporary name has no .nwb, of which there is a warning
        with warnings.catch_warnings(action="ignore"), NWBHDF5IO(str(partial), "w") as io:
            io.write(nwbfile)
        frame = 0
        with h5py.File(partial, "r+") as file:
            for one in progress.track(laid, "writing", len(laid)):
                frame = fill(file, one, frame)


def _described(wanted: NwbExport, config: dict[str, Any], recordings: Sequence[Responses]) -> Any:
    """Return an NWB file without data: what was done, with which sensor."""
    from pynwb import NWBFile
    from pynwb.file import Subject

    simulated = bool(config.get("declared", {}).get("simulated"))
    textures = sorted({str(one.attrs[dims.TEXTURE]) for one in recordings})
    start = wanted.start_time or datetime.fromtimestamp(
        (wanted.store / ROOT).stat().st_mtime, tz=UTC
    )
    nwbfile = NWBFile(
        session_description="A soft tactile fingertip slides over textures"
        f"{', simulated' if simulated else ''}. {_CLOCK}{_UNITS}",
        identifier=str(uuid4()),
        session_start_time=start if start.tzinfo else start.replace(tzinfo=UTC),
        session_id=str(config.get("session", "")) or None,
        experiment_description=f"{len(recordings)} recordings of {len(textures)} textures: "
        f"{', '.join(textures)}.",
        protocol="The fingertip is pressed on a texture, which moves under it at a constant speed. "
        "A trial is the part of a recording at constant speed.",
        keywords=["touch", "texture", "tactile fingertip", "artificial afferents"],
        data_collection=json.dumps(config, default=str),
        notes=f"Units: {wanted.model}, seed {wanted.seed}."
        + (" The session start is when the store was written." * (wanted.start_time is None)),
        source_script=f"{_SCRIPT} {wanted.store.name} {wanted.out.name}",
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
    return nwbfile


def _session(wanted: NwbExport, recordings: Sequence[Responses]) -> dict[str, Recording]:
    """Return the session's recordings by name, which must be those that the store is made of."""
    if wanted.session is None:
        return {}
    session = read_session(wanted.session)
    found = {one.name: one for one in session.recordings}
    for responses in recordings:
        name, checksum = responses.attrs["name"], responses.attrs.get("checksum")
        if name not in found:
            raise InputError(
                f"{wanted.session}: expected the recording '{name}' of the store, found none"
            )
        if checksum and checksum != check_files(found[name], session.declared):
            expected = f"the files of '{name}' that the store was extracted from"
            raise InputError(
                f"{wanted.session}: expected {expected}, found others; give that session, or none"
            )
    return found


def _require_one_layout(store: Path, recordings: Sequence[Responses]) -> None:
    """Refuse tracks of several sensors: there is one series a marker."""
    numbers = {one.sizes[dims.MARKER] for one in recordings if dims.POSITION in one}
    if len(numbers) > 1:
        found = " and ".join(map(str, sorted(numbers)))
        raise InputError(
            f"{store}: expected as many markers in each recording, found {found}; add --no-markers"
        )


def _is_exported(path: Path) -> bool:
    """Tell whether a file is one that `export_nwb` wrote."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return bool(file["general/source_script"].attrs["file_name"] == _SCRIPT)
    except (OSError, KeyError):
        return False


# The command that writes a file for neuroscientists: a store as NWB.


def export_nwb(
    store: Place,
    out: Place,
    session: Place | None = None,
    model: str = "izhikevich",
    seed: int = 0,
    classes: str | Sequence[str] = ("SA", "RA", "PC"),
    sound: bool = True,
    markers: bool = True,
    start_time: str | datetime | None = None,
    force: bool = False,
    quiet: bool = False,
) -> Path:
    """Write a store as an NWB file: spikes of artificial afferents, trials, sound and markers.

    Recordings lie one after another on the session's clock. Needs the extra ``nwb``.

    Parameters
    ----------
    store
        As `extract` writes it.
    out
        File to write, ending in ``.nwb``.
    session
        The folder that the store was extracted from: its videos are then named in the file, by
        their paths from there. None for no videos.
    model, seed, classes
        Of the units: ``izhikevich`` or ``lif``, how they differ, and some of SA, RA and PC.
    sound, markers
        Whether the vibration and the marker tracks are written too.
    start_time
        When the session began, such as ``2026-03-31T09:30+02:00``; without a zone it is UTC. None
        for when the store was written.
    force
        Whether a file that was exported there before may be replaced.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputError
        If there is no store, the session is another one's, the packages are missing, or another
        file is there already.

    Examples
    --------
    >>> export_nwb("responses.zarr", "session.nwb", session="session")
    PosixPath('session.nwb')
    """
    named = classes.replace(",", " ").split() if isinstance(classes, str) else classes
    folder = None if session is None else Path(session)
    wanted = NwbExport(
        Path(store), Path(out), folder, model, seed, tuple(named), sound, markers, _time(start_time)
    )
    with Progress(quiet) as progress:
        write_nwb(wanted, progress, force)
    return Path(out)


def _time(given: str | datetime | None) -> datetime | None:
    """Return when a session began."""
    if given is None or isinstance(given, datetime):
        return given
    try:
        return datetime.fromisoformat(given)
    except ValueError:
        wanted = "a date and time such as 2026-03-31T09:30+02:00"
        raise InputError(f"--start-time: expected {wanted}, found '{given}'") from None

"""A store as an NWB file, whole or not at all: units, trials, videos, sound, tracks on one clock.

Sound and tracks are large. The file is written without them first; each recording's are then put
into their places in it, so that one recording at a time is in memory.
"""

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents import choices, dims, files
from afferents.errors import InputError, reading
from afferents.files import Place
from afferents.plugins import import_extra
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.session import match_recordings
from afferents.spikes.artificial import artificial_spikes, choose_stretch, end_times
from afferents.spikes.population import Spikes
from afferents.spikes.units import RATE_HZ
from afferents.store import integrity, zarr_store
from afferents.store.recording import Recording
from afferents.store.responses import Responses, check_values, conditions, textures_of
from afferents.version import __version__

CAMERA, TRACKS = "camera", "markers"
_CHUNK = 4096
_REGULAR_S = 1e-6
"""Steps between frames that differ less are one rate."""
_COMPRESSION = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
GAP_S = 1.0
"""Between recordings: how long it really was is not known."""
_TRIALS = {
    "texture": "What the fingertip slid over.",
    "speed_mm_s": "Sliding speed in mm/s; NaN where it is not known.",
    "repetition": "Number of the repetition, from 0.",
    "recording": "Name of the recording in the store.",
}
_UNITS = {
    "unit_name": "Name of the unit.",
    "class": "SA: slowly adapting type I. RA: rapidly adapting type I. PC: Pacinian (RA-II).",
    "resolution_s": "Spike times are no finer than this, in s: frames of the camera are this far "
    "apart, and times between them are interpolated.",
}
_FIELD = "Markers that drive the unit (SA, RA), or channels of the vibration (PC), from 0."
_TAKEN = ("id", "start_time", "stop_time", "duration_s", "tags", "timeseries")
_SCRIPT = "afferents export-nwb"
"""In a file of ours, by which it is known as one."""
_CLOCK = (
    "All times are on one clock that counts from the beginning of the first recording. Recordings "
    f"follow one another on it, at least {GAP_S:g} s apart, by texture and speed: in "
    "which order and at which time of day they were made is not known. "
)
_ARTIFICIAL = (
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
    placed = place_recordings(recordings)
    with Progress(quiet) as progress:
        read = progress.track(recordings, "spikes", len(recordings))
        spikes = artificial_spikes(read, model, seed, choices.words_in(classes))
        nwbfile = _make_file(store, out, recordings, began, f"{model}, seed {seed}")
        add_units(nwbfile, spikes, add_trials(nwbfile, spikes, placed))
        if of_session:
            add_videos(nwbfile, placed, of_session, out)
        if sound:
            add_sounds(nwbfile, placed)
        if markers:
            add_tracks(nwbfile, placed)
        with files.write_aside(out) as partial:
            # the temporary name has no .nwb, of which there is a warning
            with warnings.catch_warnings(action="ignore"), pynwb.NWBHDF5IO(str(partial), "w") as io:
                io.write(nwbfile)
            frame = 0
            with h5py.File(partial, "r+") as file:
                for one in progress.track(placed, "writing", len(placed)):
                    frame = write_values(file, one, frame)
    return out


def _make_file(
    store: Path, out: Path, recordings: Sequence[Responses], began: datetime | None, units: str
) -> Any:
    """Return an NWB file without data: what was done, with which sensor."""
    import pynwb

    config = zarr_store.store_config(store)
    simulated = bool(config.get("declared", {}).get("simulated"))
    textures = textures_of(recordings)
    written = datetime.fromtimestamp((store / integrity.ROOT).stat().st_mtime, tz=UTC)
    nwbfile = pynwb.NWBFile(
        session_description="A soft tactile fingertip slides over textures"
        f"{', simulated' if simulated else ''}. {_CLOCK}{_ARTIFICIAL}",
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
    nwbfile.subject = pynwb.file.Subject(
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
        name=CAMERA, description="Films the markers on the inside of the fingertip's skin."
    )
    return nwbfile


def _is_exported(path: Path) -> bool:
    """Return whether `export_nwb` wrote a file."""
    import h5py

    with suppress(OSError, KeyError), h5py.File(path, "r") as file:
        return bool(file["general/source_script"].attrs["file_name"] == _SCRIPT)
    return False


class Placed(NamedTuple):
    """A recording's place on the session's clock.

    Attributes
    ----------
    name
        Its name, as a file's object may be called; see `files.safe_names`.
    responses
        Of the recording.
    start_s
        When it began.
    """

    name: str
    responses: Responses
    start_s: float

    @property
    def frame_times_s(self) -> NDArray[np.float64]:
        """`(time,)`, when its frames were taken, on the session's clock."""
        return self.start_s + np.asarray(self.responses[dims.TIME].values, np.float64)


def place_recordings(recordings: Sequence[Responses]) -> list[Placed]:
    """Return recordings one after another, each from a whole second on.

    A store does not say at which time of day each recording was made, and NWB has one clock: it
    counts from the first recording's beginning.
    """
    found, start_s = [], 0.0
    names = files.safe_names(str(responses.attrs["name"]) for responses in recordings)
    for responses, name in zip(recordings, names.values(), strict=True):
        found.append(Placed(name, responses, start_s))
        start_s = float(np.ceil(start_s + max(end_times(responses), default=0.0) + GAP_S))
    return found


def add_trials(nwbfile: Any, spikes: Spikes, placed: Sequence[Placed]) -> NDArray[np.float64]:
    """Add a trial a recording: the stretch of it in which units were run.

    Returns
    -------
    `(trial,)`, when each begins on the session's clock, s.
    """
    from pynwb.epoch import TimeIntervals

    begin = np.array([one.start_s + choose_stretch(one.responses)[0] for one in placed])
    duration_s = spikes.trials["duration_s"].to_numpy(np.float64)
    ends = pd.DataFrame({"start_time": begin, "stop_time": begin + duration_s})
    table = ends.join(spikes.trials.drop(columns="duration_s"))
    further = pd.DataFrame([conditions(one.responses) for one in placed], index=table.index)
    for name in further:
        values = further[name].infer_objects()
        is_numeric = values.dtype.kind in "iufb"
        further[name] = values.astype(float) if is_numeric else values.fillna("").astype(str)
    names = files.safe_names(
        map(str, further)
    ).values()  # some of which mean something else in the file
    further.columns = [f"condition_{one}" if one in _TAKEN else one for one in names]
    table = table.join(further.drop(columns=[name for name in further if name in table]))
    about = {str(name): _TRIALS.get(str(name), "A condition of the recording.") for name in table}
    columns = [{"name": name, "description": text} for name, text in about.items()]
    nwbfile.trials = TimeIntervals.from_dataframe(
        table, "trials", table_description="experimental trials", columns=columns
    )
    return begin


def add_units(nwbfile: Any, spikes: Spikes, begin_s: NDArray[np.float64]) -> None:
    """Add units with their spikes on the session's clock, and when each was observed.

    Columns are made as whole arrays: spike by spike, as `add_unit` has it, a session would not fit
    into memory.
    """
    from hdmf.common import ElementIdentifiers, VectorData
    from pynwb.misc import Units

    end_s = begin_s + spikes.trials["duration_s"].to_numpy(np.float64)
    seen = [np.flatnonzero(of_unit).tolist() for of_unit in spikes.recorded.T]
    times = [
        np.concatenate([np.empty(0), *(begin_s[t] + spikes.train(t, unit) for t in trials)])
        for unit, trials in enumerate(seen)
    ]
    intervals = [np.stack([begin_s[trials], end_s[trials]], axis=1) for trials in seen]
    columns = [
        *_ragged("spike_times", "Times of spikes on the session's clock, s.", times),
        *_ragged("obs_intervals", "Trials in which the unit was there, s.", intervals),
    ]
    values = {
        "unit_name": spikes.units.index.to_numpy(str).tolist(),
        "class": spikes.units["class"].to_numpy(str).tolist(),
        "resolution_s": spikes.units["resolution_s"].to_numpy(np.float64),
    }
    for name, about in _UNITS.items():
        columns.append(VectorData(name=name, description=about, data=values[name]))
    fields = [np.asarray(field, np.int64) for field in spikes.units["receptive_field"]]
    if all(map(len, fields)):
        columns += _ragged("receptive_field", _FIELD, fields)
    nwbfile.units = Units(
        name="units",
        description="Units that the fingertip's responses drive.",
        id=ElementIdentifiers(name="id", data=np.arange(spikes.n_units)),
        resolution=1 / RATE_HZ,
        columns=columns,
        colnames=[one.name for one in columns if not one.name.endswith("_index")],
    )


def _ragged(name: str, about: str, parts: Sequence[NDArray[Any]]) -> list[Any]:
    """Return a column of several values a row, and where the values of each row end."""
    from hdmf.common import VectorData, VectorIndex

    values = VectorData(name=name, description=about, data=np.concatenate(parts))
    ends = np.cumsum([len(part) for part in parts]).astype(np.uint64)
    return [values, VectorIndex(name=f"{name}_index", data=ends, target=values)]


def add_videos(
    nwbfile: Any, placed: Sequence[Placed], recordings: Mapping[str, Recording], out: Path
) -> None:
    """Add each recording's video as an external file, by its path from the NWB file."""
    from pynwb.image import ImageSeries

    for one in placed:
        video = recordings[one.responses.attrs["name"]].video
        if video is None or dims.TIME not in one.responses.coords:
            continue
        pictures = [video.path]
        if isinstance(video, ImageFolder) and video.path.is_dir():
            pictures = [Path(str(file)) for file in video.numbered.values()]
        steps_s = np.diff(one.frame_times_s)
        clock: dict[str, Any] = {"timestamps": one.frame_times_s}
        if len(steps_s) and np.ptp(steps_s) < _REGULAR_S:  # NWB wants a rate then
            clock = {"starting_time": one.frame_times_s[0], "rate": float(1 / steps_s.mean())}
        nwbfile.add_acquisition(
            ImageSeries(
                name=f"video_{one.name}",
                description="Markers on the inside of the skin, as the camera saw them.",
                external_file=[os.path.relpath(file, out.parent.resolve()) for file in pictures],
                starting_frame=list(range(len(pictures))),
                format="external",
                dimension=[video.width, video.height],
                unit="n.a.",
                device=nwbfile.devices[CAMERA],
                num_samples=len(one.frame_times_s),
                **clock,
            )
        )


def add_sounds(nwbfile: Any, placed: Sequence[Placed]) -> None:
    """Add room for each recording's vibration: sound, or channels of another kind."""
    from ndx_sound import AcousticWaveformSeries
    from pynwb import TimeSeries

    for one in placed:
        if dims.RA2 not in one.responses:
            continue
        vibration = one.responses[dims.RA2]
        shape = vibration.shape[:1] if vibration.shape[1] == 1 else vibration.shape
        unit = str(vibration.attrs.get(dims.UNITS) or "n.a.")
        # A series of sound has one or two channels, and no unit: others keep theirs.
        is_sound = unit in ("full scale", "n.a.") and (len(shape) == 1 or shape[1] == 2)
        kind = AcousticWaveformSeries if is_sound else TimeSeries
        nwbfile.add_acquisition(
            kind(
                name=f"sound_{one.name}",
                description="RA-II: vibration, as recorded.",
                data=_room(shape, True),
                unit=unit,
                rate=float(vibration.attrs[dims.SAMPLE_RATE]),
                starting_time=one.start_s,
            )
        )


def _room(shape: tuple[int, ...], chunks: Any) -> Any:
    """Return room for numbers that are written when the file is there."""
    from hdmf.backends.hdf5 import H5DataIO

    return H5DataIO(shape=shape, dtype=np.dtype("float32"), chunks=chunks, **_COMPRESSION)


def add_tracks(nwbfile: Any, placed: Sequence[Placed]) -> None:
    """Add room for where markers are seen: a series a marker, over the whole session.

    Cells, which never move, are left out.
    """
    from hdmf.backends.hdf5 import H5DataIO
    from ndx_pose import PoseEstimation, PoseEstimationSeries, Skeleton, Skeletons

    tracked = [one for one in placed if dims.POSITION in one.responses]
    if not tracked or dims.of_cells(tracked[0].responses):
        return
    nodes = [f"marker_{m:03d}" for m in range(tracked[0].responses.sizes[dims.MARKER])]
    times_s = np.concatenate([one.frame_times_s for one in tracked])
    chunk, series = min(len(times_s), _CHUNK), list[Any]()
    for marker, node in enumerate(nodes):
        series.append(
            PoseEstimationSeries(
                name=node,
                description=f"Centre of marker {marker} in the camera's image; NaN where lost.",
                data=_room((len(times_s), 2), (chunk, 2)),
                confidence=_room((len(times_s),), (chunk,)),
                confidence_definition="1 where the marker was found, 0 where it was lost",
                reference_frame="Centre of the pixel at the top left; x to the right, y down.",
                unit="pixels",
                timestamps=series[0] if series else H5DataIO(times_s, **_COMPRESSION),
            )
        )
    skeleton = Skeleton(name="skin", nodes=nodes)
    module = nwbfile.create_processing_module(
        "behavior", "Where markers on the skin are seen, all recordings one after another."
    )
    module.add(Skeletons(skeletons=[skeleton]))
    module.add(
        PoseEstimation(
            name=TRACKS,
            description="Markers on the inside of the skin, followed from frame to frame.",
            pose_estimation_series=series,
            skeleton=skeleton,
            device=nwbfile.devices[CAMERA],
            source_software="afferents",
        )
    )


def write_values(file: Any, one: Placed, first_frame: int) -> int:
    """Write sound and tracks of a recording where there is room for them in the HDF5 file.

    Parameters
    ----------
    file
        A `h5py.File`.
    first_frame
        Where its frames begin among those of the session.

    Returns
    -------
    Where those of the next begin.
    """
    name = one.responses.attrs["name"]
    sound = f"acquisition/sound_{one.name}/data"
    if sound in file:
        values = check_values(one.responses[dims.RA2], f"{dims.RA2} of {name}").values
        file[sound][...] = values.reshape(file[sound].shape)
    tracks = f"processing/behavior/{TRACKS}"
    if tracks not in file or dims.POSITION not in one.responses:
        return first_frame
    where = f"{dims.POSITION} of {name}"
    position = check_values(one.responses[dims.POSITION], where).values
    detected = one.responses[dims.DETECTED].values
    last = first_frame + len(position)
    for marker in range(position.shape[1]):
        series = file[f"{tracks}/marker_{marker:03d}"]
        series["data"][first_frame:last] = position[:, marker]
        series["confidence"][first_frame:last] = detected[:, marker]
    return last

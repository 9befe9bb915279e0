"""From a session's videos and audio to a store of responses, a recording after the other."""

import json
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr

from afferents import dims, parallel
from afferents.channels import compute_sa1, ra1, ra2
from afferents.choices import Method, Rest, require_workers
from afferents.errors import AfferentsError, InputError
from afferents.extraction import clocks, copies
from afferents.extraction.issues import find_issues, watched
from afferents.extraction.options import Extraction, describe_declaration
from afferents.files import Place, remove, remove_partials
from afferents.markers import track
from afferents.markers.detect import Positions, upright_tracks
from afferents.markers.sensor import Sensor, resolve_sensor
from afferents.markers.session_sensors import Sensors, default_sentences, find_sensors
from afferents.outputs import writing_alone
from afferents.progress import Progress
from afferents.quality.issues import parse_kinds, require_accepted
from afferents.recordings import check, grid, media
from afferents.recordings.data_sets import read_session
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.session import Session
from afferents.recordings.session_file import SessionFile
from afferents.store import drum_path, integrity, motion, zarr_store
from afferents.store.log import Lag
from afferents.store.recording import Recording, Video
from afferents.store.responses import Responses, add_issues, label


def extract_session(extraction: Extraction, progress: Progress) -> dict[str, str]:
    """Extract every recording that the store does not hold yet.

    What it holds under another declaration is removed first: if a recording then fails, or the
    command is stopped, no old responses are left among the new. A store without any is removed.

    Returns
    -------
    Recordings that failed and why; empty unless `keep_going`.

    Raises
    ------
    InputError
        If the session, one of its recordings (without `keep_going`), or the store is not what
        it should be, or the store holds responses of other files; recordings extracted before stay.
    AfferentsError
        If a recording is not what it should be (without `keep_going`), or a process died.
    """
    extraction = extraction.as_found_anywhere()
    given, fps_hz = extraction.session, extraction.fps_hz
    session = given.at_rate(fps_hz) if isinstance(given, Session) else read_session(given, fps_hz)
    sensors = find_sensors(session, extraction.sensor)
    for sentence in default_sentences(session, extraction.sensor):
        progress.note(sentence)
    if session.declared.rest is not None:
        extraction = extraction.model_copy(update={"rest": session.declared.rest})
    lags = clocks.measure_clocks(session, sensors)
    session = clocks.set_clocks(session, lags)
    reference = _reference(session, sensors.usual, extraction)
    check.require_own_files(session)
    grid.require_rates_that_agree(session, session.declared)
    with writing_alone(extraction.out, "extract"):
        zarr_store.create_store(extraction.out, extraction.config(session, sensors))
        declared = {r.name: describe_declaration(r, session, sensors) for r in session.recordings}
        for recording in session.recordings:
            there = zarr_store.attributes_there(extraction.out / recording.name)
            if there and there.get("declared") != declared[recording.name]:
                checksum = check.check_files(recording, session.declared)
                zarr_store.require_same_files(extraction.out, recording.name, checksum)
                remove(extraction.out / recording.name)
        zarr_store.create_parents(extraction.out, list(declared))
        remove_partials(extraction.out)
        for sentence in clocks.describe(lags, session.press.name) if session.press else ():
            progress.note(sentence)
        outcomes = _outcomes(session, sensors, declared, reference, extraction, progress)
        try:
            with closing(outcomes):  # no process writes any more
                return _failures(session, outcomes, extraction, progress)
        finally:
            zarr_store.remove_empty(extraction.out, declared)


def _failures(
    session: Session,
    outcomes: Iterator[tuple[str, str | None]],
    extraction: Extraction,
    progress: Progress,
) -> dict[str, str]:
    """Extract what is missing; return the recordings that failed, and why."""
    failed: dict[str, str] = {}
    for name, fault in progress.track(outcomes, "extracting", len(session.recordings)):
        if fault is None:
            continue
        if not extraction.keep_going:
            others = len(session.recordings) > 1
            raise AfferentsError(f"{fault}; --keep-going leaves it out" if others else fault)
        failed[name] = fault
    notes = copies.read_notes(extraction.out)
    without = [
        Path(r.name)
        for r in session.recordings
        if r.speed_mm_s is None and not {log.name for log in r.beside} & motion.TELL_SPEED
    ]
    speedless = [
        f"{len(without)} of {len(session.recordings)} recordings say no speed "
        f"({media.named(Path(), without)}): to hold out speeds, write speed_mm_s into the session "
        "file and extract again"
    ] * bool(without)
    for sentence in (
        *notes.sentences,
        *notes.of_force,
        *speedless,
        *session.left_out(),
    ):
        progress.note(sentence)
    return failed


def _outcomes(
    session: Session,
    sensors: Sensors,
    declared: Mapping[str, str],
    reference: Positions | None,
    extraction: Extraction,
    progress: Progress,
) -> Generator[tuple[str, str | None], None, None]:
    """Extract here or on a cluster; yield each recording's name, and what is wrong with it."""
    if extraction.cluster is not None:
        order = None if reference is None else reference.tolist()
        files = [str(path) for recording in session.recordings for path in recording.files]
        given = extraction.model_dump(mode="json")
        lags = {log.name: log.lag for r in session.recordings for log in r.beside}
        sent = json.dumps({"extraction": given, "reference": order, "files": files, "lags": lags})
        far = ((sent, recording.name) for recording in session.recordings)
        packages = parallel.SAME + parallel.OF_RECORDINGS
        return parallel.on_cluster(_try_far, far, extraction.cluster, extraction.out, packages)
    jobs = (
        (
            recording,
            session.declared.of(recording.name),
            declared[recording.name],
            reference,
            extraction.model_copy(  # light, since it goes to each process
                update={"session": session.root, "sensor": sensors.of(recording)}
            ),
        )
        for recording in session.recordings
    )
    return parallel.side_by_side(_try_one, jobs, extraction.workers, progress.note)


def _reference(session: Session, sensor: Sensor, extraction: Extraction) -> Positions | None:
    """Return the marker order of the published tracker, or the rest positions to count from.

    Raises
    ------
    InputError
        If they are wanted and there is no reference clip.
    """
    if extraction.rest == "reference":
        if session.reference is None or extraction.method == "published":
            raise InputError(
                "--rest reference: expected a session with a reference clip (throw_away.mp4, or "
                "'reference' in the session file) and a tracker other "
                "than 'published', found "
                f"{'none' if session.reference is None else 'the published tracker'}"
            )
        return track.ordered_rest(session.reference, adapt_to_still(session.reference, sensor))
    if session.reference is None or extraction.method != "published":
        return None
    return track.rest_positions(session.reference, adapt_to_still(session.reference, sensor))


def adapt_to_still(reference: Video, sensor: Sensor) -> Sensor:
    """Return the sensor for a reference clip, whose only frame is the rest frame if it is a still.

    Other clips have the rest frame that the sensor file says.
    """
    is_still = isinstance(reference, ImageFolder) and reference.n_frames == 1
    return sensor.model_copy(update={"rest_frame": 0}) if is_still else sensor


def _try_one(recording: Recording, *others: Any) -> tuple[str, str | None]:
    """Return the recording's name, and what is wrong with it.

    Raises
    ------
    zarr_store.OtherFilesError
        If the store holds responses of other files: to go on would mix old with new.
    """
    cv2.setNumThreads(1)
    try:
        _extract_one(recording, *others)
    except zarr_store.OtherFilesError:
        raise
    except AfferentsError as error:
        return recording.name, str(error)
    return recording.name, None


def _try_far(sent: str, name: str) -> tuple[str, str | None]:
    """Do the same on a worker, which is told by JSON and reads the session itself.

    Raises
    ------
    InputError
        If the worker doesn't see the recording, which is no fault of the recording's.
    """
    extraction, reference, session, sensors = _received(sent)
    recording = next(r for r in session.recordings if r.name == name)
    return _try_one(
        recording,
        session.declared.of(name),
        describe_declaration(recording, session, sensors),
        reference,
        extraction.model_copy(update={"sensor": sensors.of(recording)}),
    )


@lru_cache(maxsize=1)
def _received(sent: str) -> tuple[Extraction, Positions | None, Session, Sensors]:
    """Return what a worker extracts, once for all recordings of a session."""
    found = json.loads(sent)
    extraction, order = Extraction.model_validate(found["extraction"]), found["reference"]
    parallel.require_seen(found["files"])
    session = read_session(found["extraction"]["session"], extraction.fps_hz)
    session = clocks.set_clocks(session, {name: Lag(*lag) for name, lag in found["lags"].items()})
    sensors = find_sensors(session, extraction.sensor)
    return extraction, None if order is None else np.array(order), session, sensors


def _extract_one(
    recording: Recording,
    declared: SessionFile,
    matters: str,
    reference: Positions | None,
    extraction: Extraction,
) -> None:
    """Extract a recording that the store doesn't hold; say what was made of what, and accepted."""
    checksum = check.check_files(recording, declared)
    zarr_store.require_same_files(extraction.out, recording.name, checksum)
    if zarr_store.is_whole(extraction.out, recording.name):
        return
    issues = check.check_recording(recording, declared, extraction.accept)
    if not extraction.vibration:
        if recording.video is None:
            raise InputError(f"{recording.name}: expected a video to track, found none")
        recording = replace(recording, audio=None)
    logs = recording.beside
    began_s = getattr(recording.video, "began_s", 0.0) if logs else 0.0
    recording = watched(recording)
    found = responses_of(
        recording, extraction.sensor, extraction.method, reference, extraction.rest
    )
    if (way := drum_path.logged_path(recording.source)) is not None:
        found = found.assign({dims.DRUM_POSITION: way.variable()})
    found = found.assign({log.name: log.variable(began_s) for log in logs})
    found = motion.add_motion(found, logs)
    issues += require_accepted(find_issues(recording, found), extraction.accept)
    found = add_issues(copies.add_fingerprint(found), issues)
    found = found.assign_attrs(checksum=checksum, declared=matters)
    zarr_store.write_responses(extraction.out, found)


def responses_of(
    recording: Recording,
    sensor: Sensor | None = None,
    method: Method = "windowed",
    reference: Positions | None = None,
    rest: Rest = "own",
) -> Responses:
    """Return the responses of one recording: marker tracks, SA-I, RA-I and RA-II, float32.

    Parameters
    ----------
    sensor
        Needed where the recording has a video.
    reference
        Rest markers that fix the order or, with `rest` reference, that displacement counts
        from; see `markers.track`.
    """
    parts: list[xr.Dataset] = []
    if recording.video is not None and sensor is not None:
        order, count_from = (None, reference) if rest == "reference" else (reference, None)
        tracks = track.track_markers(recording.video, sensor, method, order, count_from=count_from)
        parts.append(marker_responses(tracks, sensor))
    if recording.audio is not None:
        parts.append(xr.Dataset({dims.RA2: ra2(recording.audio.read())}))
    merged = xr.merge(parts, combine_attrs="no_conflicts")
    return label(merged, recording)


def marker_responses(tracks: xr.Dataset, sensor: Sensor | None = None) -> xr.Dataset:
    """Add SA-I and RA-I to marker tracks, everything in float32, upright and undistorted."""
    tracks = tracks if sensor is None else upright_tracks(tracks, sensor)
    slow = compute_sa1(tracks)
    responses = tracks.assign({dims.SA1: slow, dims.RA1: ra1(slow)})
    real = [name for name in responses.data_vars if responses[name].dtype.kind == "f"]
    return responses.assign({name: responses[name].astype("float32") for name in real})


class Extracted(list[Responses]):
    """The recordings of a store, opened lazily, in order of texture and speed.

    Attributes
    ----------
    skipped
        Recordings that failed, by name, and why; empty unless ``keep_going`` was given.
    """

    def __init__(self, recordings: Iterable[Responses], skipped: Mapping[str, str]) -> None:
        super().__init__(recordings)
        self.skipped = dict(skipped)


def extract(
    session: "Place | Session",
    out: Place,
    sensor: "str | Path | Sensor | None" = None,
    method: Method = "windowed",
    rest: Rest = "own",
    keep_going: bool = False,
    accept: Sequence[str] = (),
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
    fps_hz: float | None = None,
) -> Extracted:
    """Turn the videos and audio of a session into marker tracks, SA-I, RA-I and RA-II.

    Recordings that the store holds already are kept.

    Parameters
    ----------
    session
        Session folder: TEXTURE/SPEED/video.mp4 and audio.wav for each run, or any files that its
        session.toml names. In Python also a `Session`.
    out
        Store (Zarr) to write, such as OUT.zarr.
    sensor
        Sensor file (TOML), or the name of a packaged one (default: what the session file names,
        else tip_b).
    method
        How markers are matched from frame to frame; 'published' repeats the reference code, flaws
        included.
    rest
        Rest positions that SA-I is measured from: of each recording's 'own' rest frame, or of the
        'reference' clip throw_away.mp4.
    keep_going
        Skip recordings that fail, name them, and exit with code 3.
    accept
        Keep recordings that fail this check, and mark them; may be repeated. Checks: length,
        dark, frozen, repeated, loud.
    workers
        Processes to run in parallel (default: one per core).
    cluster
        Run on a Dask cluster instead, such as tcp://scheduler:8786.
    quiet
        No progress bars; plain lines on stderr.
    fps_hz
        True frame rate of the videos, frames a second, where their files say another; times then
        count from it (default: what the session file says, else the files).

    Returns
    -------
    Extracted
        A list of `xarray.Dataset`, a recording each, opened lazily; see `afferents.store.responses`
        for what is in it. Its `skipped` names what ``keep_going`` left out.

    Raises
    ------
    InputError
        If the session, the store, or (without `keep_going`) a recording is not what it should be.

    Examples
    --------
    >>> recordings = extract("session", "responses.zarr")
    >>> recordings[0].sa1.dims
    ('time', 'marker')
    """
    require_workers(workers)
    wanted = Extraction(
        session=Path(session) if isinstance(session, str | Path) else session, out=Path(out),
        sensor=None if sensor is None else resolve_sensor(sensor), method=method,
        keep_going=keep_going, workers=workers, rest=rest, cluster=cluster,
        accept=parse_kinds(list(accept)), fps_hz=fps_hz,
    )  # fmt: skip
    with Progress(quiet) as progress:
        skipped = extract_session(wanted, progress)
    found = zarr_store.open_responses(Path(out)) if integrity.is_group(Path(out)) else []
    return Extracted(found, skipped)

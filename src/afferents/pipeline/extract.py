"""From a session's videos and audio to a store of responses."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import xarray as xr

from afferents.channels import ra1, ra2, sa1
from afferents.core import dims
from afferents.core.choices import Rest
from afferents.core.doubt import Doubt, accepted
from afferents.core.drum import logged_way
from afferents.core.errors import AfferentsError, InputError
from afferents.core.files import remove_partials, size_of
from afferents.core.lock import writing_alone
from afferents.core.progress import Progress
from afferents.core.recording import Recording
from afferents.core.responses import Responses, label, with_doubts
from afferents.core.store import (
    create_parents,
    create_store,
    has_responses,
    is_of_same_files,
    require_no_store,
    responses_there,
    write_responses,
)
from afferents.execution.dask import OF_RECORDINGS, SAME, Output, on_cluster, require_same_file
from afferents.execution.local import side_by_side
from afferents.markers import (
    Method,
    Positions,
    Sensor,
    ordered_rest,
    rest_positions,
    track,
    undistorted,
)
from afferents.pipeline.copies import notes_of, with_fingerprint
from afferents.pipeline.doubts import doubts_of, watched
from afferents.pipeline.extraction import Extraction, declared_of, origin_of, relabel
from afferents.pipeline.sensors import Sensors, sensors_of
from afferents.recordings import (
    Session,
    SessionFile,
    check_recording,
    read_session,
    require_own_files,
    require_rates_that_agree,
)


def extract(extraction: Extraction, progress: Progress) -> dict[str, str]:
    """Extract every recording that the store does not hold yet.

    Returns
    -------
    Recordings that failed and why; empty unless `keep_going`.

    Raises
    ------
    InputError
        If the session, one of its recordings (without `keep_going`), or the store is not what
        it should be; recordings extracted before stay.
    AfferentsError
        If a recording is not what it should be (without `keep_going`), or a process died.
    """
    extraction = extraction.as_found_anywhere()
    given, fps_hz = extraction.session, extraction.fps_hz
    session = given.at_rate(fps_hz) if isinstance(given, Session) else read_session(given, fps_hz)
    sensors = sensors_of(session, extraction.sensor)
    reference = _reference(session, sensors.usual, extraction)
    require_own_files(session)
    require_rates_that_agree(session, session.declared)
    require_no_store(extraction.out)
    with writing_alone(extraction.out, "extract") as token:
        create_store(extraction.out, extraction.config(session, sensors))
        create_parents(extraction.out, [recording.name for recording in session.recordings])
        remove_partials(extraction.out)
        outcomes = (
            _outcomes_here(session, sensors, reference, extraction, progress)
            if extraction.cluster is None
            else _outcomes_there(session, sensors, reference, extraction, token)
        )
        return _failures(session, outcomes, extraction, progress)


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
            raise AfferentsError(fault)
        failed[name] = fault
    for sentence in notes_of(extraction.out).sentences:
        progress.note(sentence)
    return failed


def _outcomes_here(
    session: Session,
    sensors: Sensors,
    reference: Positions | None,
    extraction: Extraction,
    progress: Progress,
) -> Iterator[tuple[str, str | None]]:
    """Extract on this machine; yield each recording's name, and what is wrong with it."""
    jobs = (
        (recording, session.declared.of(recording.name), reference, one)
        for recording, one in _jobs(session, sensors, extraction)
    )
    return side_by_side(_try_one, jobs, extraction.workers, progress.note)


def _jobs(
    session: Session, sensors: Sensors, extraction: Extraction
) -> Iterator[tuple[Recording, Extraction]]:
    """Yield each recording, and how it is extracted: with its own sensor."""
    light = replace(extraction, session=session.root)  # what goes to each process
    for recording in session.recordings:
        yield recording, replace(light, sensor=sensors.of(recording))


def _outcomes_there(
    session: Session,
    sensors: Sensors,
    reference: Positions | None,
    extraction: Extraction,
    token: str,
) -> Iterator[tuple[str, str | None]]:
    """Extract on a cluster; write what comes back from workers that don't see the store."""
    output = Output(extraction.out, token)
    jobs = (
        (
            recording,
            {path: size_of(path) for path in recording.files},
            session.declared.of(recording.name),
            reference,
            one,
            output,
            responses_there(extraction.out, recording.name),
        )
        for recording, one in _jobs(session, sensors, extraction)
    )
    packages = SAME + OF_RECORDINGS
    declared = {
        recording.name: (
            recording,
            declared_of(recording, session.declared.of(recording.name), one),
        )
        for recording, one in _jobs(session, sensors, extraction)
    }
    for name, fault, found in on_cluster(_try_far, jobs, extraction.cluster or "", packages):
        if found is not None:
            write_responses(extraction.out, found)
        elif fault is None:
            relabel(extraction.out, *declared[name])
        yield name, fault


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
                "--rest reference",
                "a session with throw_away.mp4 and a tracker other than 'published'",
                "none" if session.reference is None else "the published tracker",
            )
        return ordered_rest(session.reference, sensor)
    if session.reference is None or extraction.method != "published":
        return None
    return rest_positions(session.reference, sensor)


def _try_one(
    recording: Recording,
    declared: SessionFile,
    reference: Positions | None,
    extraction: Extraction,
) -> tuple[str, str | None]:
    """Return the recording's name, and what is wrong with it."""
    cv2.setNumThreads(1)
    try:
        doubts = check_recording(recording, declared, extraction.accept)
        _extract_one(recording, declared, reference, extraction, doubts)
    except AfferentsError as error:
        return recording.name, str(error)
    return recording.name, None


def _try_far(
    recording: Recording,
    sizes: Mapping[Path, int],
    declared: SessionFile,
    reference: Positions | None,
    extraction: Extraction,
    output: Output,
    there: tuple[str, str] | None,
) -> tuple[str, str | None, Responses | None]:
    """Do the same on a worker; one that doesn't see the store returns the responses as well.

    Parameters
    ----------
    sizes
        Of the recording's files, in bytes, where the command runs.
    there
        From which files the store has the recording already, and how these were declared.

    Raises
    ------
    InputError
        If the worker doesn't see the recording as it is.
    """
    for path, size in sizes.items():
        require_same_file(path, size)
    if output.is_seen:
        return *_try_one(recording, declared, reference, extraction), None
    cv2.setNumThreads(1)
    try:
        doubts = check_recording(recording, declared, extraction.accept)
        made_of = origin_of(recording, declared, extraction)
        if there is not None and is_of_same_files(output.folder / recording.name, there, made_of):
            return recording.name, None, None
        found = _new_responses(recording, made_of, reference, extraction, doubts)
        return recording.name, None, found
    except AfferentsError as error:
        return recording.name, str(error), None


def _extract_one(
    recording: Recording,
    declared: SessionFile,
    reference: Positions | None,
    extraction: Extraction,
    doubts: list[Doubt],
) -> None:
    made_of = origin_of(recording, declared, extraction)
    if has_responses(extraction.out, recording.name, *made_of):
        relabel(extraction.out, recording, made_of[1])
        return
    found = _new_responses(recording, made_of, reference, extraction, doubts)
    write_responses(extraction.out, found)


def _new_responses(
    recording: Recording,
    made_of: tuple[str, str],
    reference: Positions | None,
    extraction: Extraction,
    doubts: list[Doubt],
) -> Responses:
    """Extract a recording; its responses say what they were made of, and what was accepted."""
    if not extraction.vibration:
        if recording.video is None:
            raise InputError(recording.name, "a video to track", "none")
        recording = replace(recording, audio=None)
    recording = watched(recording)
    found = responses_of(
        recording, extraction.sensor, extraction.method, reference, extraction.rest
    )
    if (way := logged_way(recording.source)) is not None:
        found = found.assign({dims.DRUM_POSITION: way.variable()})
    doubts = doubts + accepted(doubts_of(recording, found), extraction.accept)
    found = with_doubts(with_fingerprint(found), doubts)
    checksum, matters = made_of
    return found.assign_attrs(checksum=checksum, declared=matters)


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
        tracks = track(recording.video, sensor, method, order, count_from=count_from)
        _require_times_that_go_on(tracks, recording.video.path)
        parts.append(marker_responses(undistorted(tracks, sensor.lens)))
    if recording.audio is not None:
        parts.append(xr.Dataset({dims.RA2: ra2(recording.audio.read())}))
    merged = xr.merge(parts, combine_attrs="no_conflicts")
    return label(merged, recording)


def _require_times_that_go_on(tracks: xr.Dataset, path: Path) -> None:
    """Refuse a video whose frames are not in order of time, such as some H.264 in avi.

    Raises
    ------
    InputError
        Naming the first frame that isn't.
    """
    time_s = tracks[dims.TIME].values
    back = np.flatnonzero(~(np.diff(time_s) > 0))
    if len(back):
        before, after = time_s[back[0]], time_s[back[0] + 1]
        raise InputError(
            path,
            "frame times of which each is after the one before",
            f"{after:.3f} s after {before:.3f} s",
            "give --fps with the true rate, or write its fps_hz into session.toml: times then "
            "count from it",
        )


def marker_responses(tracks: xr.Dataset) -> xr.Dataset:
    """Add SA-I and RA-I to marker tracks, everything in float32."""
    slow = sa1(tracks[dims.POSITION], tracks[dims.REST_POSITION])
    responses = tracks.assign({dims.SA1: slow, dims.RA1: ra1(slow)})
    real = [name for name in responses.data_vars if responses[name].dtype.kind == "f"]
    return responses.assign({name: responses[name].astype("float32") for name in real})

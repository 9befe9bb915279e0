"""From a session's videos and audio to a store of responses."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import cv2
import xarray as xr

from afferents import __version__
from afferents.channels import ra1, ra2, sa1
from afferents.core import dims
from afferents.core.doubt import Doubt, Kind, accepted
from afferents.core.errors import AfferentsError, InputError
from afferents.core.files import remove_partials
from afferents.core.progress import Progress
from afferents.core.recording import Recording, Session
from afferents.core.responses import Responses, label, with_doubts
from afferents.core.store import create_parents, create_store, has_responses, write_responses
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
from afferents.pipeline.parallel import side_by_side
from afferents.recordings import SessionFile, check_recording, read_session, session_file

Rest = Literal["own", "reference"]
"""Whether displacement counts from each recording's own rest frame or the reference clip's."""


@dataclass(frozen=True)
class Extraction:
    """What is extracted and how.

    Attributes
    ----------
    accept
        Kinds of what may be wrong with a recording that is kept nevertheless, and marked.
    """

    session: Path
    out: Path
    sensor: Sensor
    method: Method
    keep_going: bool = False
    workers: int | None = None
    vibration: bool = True
    rest: Rest = "own"
    accept: frozenset[Kind] = frozenset()

    def config(self, session: Session, declared: SessionFile) -> dict[str, Any]:
        """Return what must agree for recordings to stand in one store.

        `recordings` names all that the store is to hold, so that half a store is known as one.
        """
        return {
            "afferents": __version__,
            "session": self.session.resolve().name,
            "declared": declared.model_dump(mode="json"),
            "recordings": [recording.name for recording in session.recordings],
            "sensor": self.sensor.model_dump(mode="json"),
            "method": self.method,
            **({} if self.vibration else {"vibration": False}),
            **({} if self.rest == "own" else {"rest": self.rest}),
        }


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
    session = read_session(extraction.session)
    declared = session_file(extraction.session)
    reference = _reference(session, extraction)
    create_store(extraction.out, extraction.config(session, declared))
    create_parents(extraction.out, [recording.name for recording in session.recordings])
    remove_partials(extraction.out)
    failed: dict[str, str] = {}
    jobs = ((recording, declared, reference, extraction) for recording in session.recordings)
    outcomes = side_by_side(_try_one, jobs, extraction.workers, progress.note)
    for name, fault in progress.track(outcomes, "extracting", len(session.recordings)):
        if fault is None:
            continue
        if not extraction.keep_going:
            raise AfferentsError(fault)
        failed[name] = fault
    for sentence in notes_of(extraction.out).sentences:
        progress.note(sentence)
    return failed


def _reference(session: Session, extraction: Extraction) -> Positions | None:
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
        return ordered_rest(session.reference, extraction.sensor)
    if session.reference is None or extraction.method != "published":
        return None
    return rest_positions(session.reference, extraction.sensor)


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
        _extract_one(recording, reference, extraction, doubts)
    except AfferentsError as error:
        return recording.name, str(error)
    return recording.name, None


def _extract_one(
    recording: Recording, reference: Positions | None, extraction: Extraction, doubts: list[Doubt]
) -> None:
    checksum = recording.checksum
    if not has_responses(extraction.out, recording.name, checksum):
        if not extraction.vibration:
            if recording.video is None:
                raise InputError(recording.name, "a video to track", "none")
            recording = replace(recording, audio=None)
        recording = watched(recording)
        found = responses_of(
            recording, extraction.sensor, extraction.method, reference, extraction.rest
        )
        doubts = doubts + accepted(doubts_of(recording, found), extraction.accept)
        found = with_doubts(with_fingerprint(found), doubts)
        write_responses(extraction.out, found.assign_attrs(checksum=checksum))


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
        parts.append(marker_responses(undistorted(tracks, sensor.lens)))
    if recording.audio is not None:
        parts.append(xr.Dataset({dims.RA2: ra2(recording.audio.read())}))
    merged = xr.merge(parts, combine_attrs="no_conflicts")
    return label(merged, recording)


def marker_responses(tracks: xr.Dataset) -> xr.Dataset:
    """Add SA-I and RA-I to marker tracks, everything in float32."""
    slow = sa1(tracks[dims.POSITION], tracks[dims.REST_POSITION])
    responses = tracks.assign({dims.SA1: slow, dims.RA1: ra1(slow)})
    real = [name for name in responses.data_vars if responses[name].dtype.kind == "f"]
    return responses.assign({name: responses[name].astype("float32") for name in real})

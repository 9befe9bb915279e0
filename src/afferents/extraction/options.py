"""What `extract` is asked for, and what of a recording's declaration its responses rest on."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from afferents.choices import Method, Rest
from afferents.files import checksum
from afferents.markers.sensor import Sensor, Sensors
from afferents.quality.issues import Kind
from afferents.recordings.check import check_files
from afferents.recordings.session import Session
from afferents.recordings.session_file import SessionFile
from afferents.store.recording import Recording
from afferents.store.responses import ACCEPTED, labels_of
from afferents.store.zarr_store import stored_attributes, update_labels
from afferents.version import __version__


@dataclass(frozen=True)
class Extraction:
    """What is extracted and how.

    Attributes
    ----------
    session
        A session folder, or a session that has been made of a table.
    sensor
        None for what the session file says, else ``tip_b``.
    cluster
        Address of a Dask scheduler whose workers extract; None for this machine.
    accept
        Kinds of what may be wrong with a recording that is kept nevertheless, and marked.
    fps_hz
        True frame rate of all videos, whatever their containers say; None for what these and the
        session file say.
    """

    session: Path | Session
    out: Path
    sensor: Sensor | None
    method: Method
    keep_going: bool = False
    workers: int | None = None
    vibration: bool = True
    rest: Rest = "own"
    cluster: str | None = None
    accept: frozenset[Kind] = frozenset()
    fps_hz: float | None = None

    def as_found_anywhere(self) -> "Extraction":
        """Return it with paths that a cluster's workers find, wherever they were started."""
        if self.cluster is None:
            return self
        there = self.session.resolve() if isinstance(self.session, Path) else self.session
        return replace(self, session=there, out=self.out.resolve())

    def config(self, session: Session, sensors: Sensors) -> dict[str, Any]:
        """Return what must agree for recordings to stand in one store.

        `recordings` names all that the store is to hold, so that half a store is known as one.
        """
        clip = session.reference
        leads = self.rest == "reference" or self.method == "published"
        return {
            "afferents": __version__,
            "session": session.root.resolve().name,
            "declared": session.declared.model_dump(
                mode="json", exclude={"checksums", "recordings"}
            ),
            "recordings": [recording.name for recording in session.recordings],
            "sensor": sensors.usual.model_dump(mode="json"),
            **({"sensors": sensors.names_in(session)} if sensors.own else {}),
            "method": self.method,
            **({} if self.vibration else {"vibration": False}),
            **({} if self.rest == "own" else {"rest": self.rest}),
            **({"reference": checksum(clip.path)} if leads and clip is not None else {}),
        }


def origin_of(
    recording: Recording, declared: SessionFile, extraction: Extraction
) -> tuple[str, str]:
    """Return the checksum of a recording's files, and what is declared of them that matters."""
    return check_files(recording, declared), declared_of(recording, declared, extraction)


def declared_of(recording: Recording, declared: SessionFile, extraction: Extraction) -> str:
    """Return what is declared of a recording: what its responses rest on, and its labels."""
    matters = declared.model_dump_json(include={"sensor_channel", "steady_s", "direction"})
    own = _of_its_own(recording, declared, extraction)
    return matters + (json.dumps(own) if own else "")


def relabel(store: Path, recording: Recording, declared: str) -> None:
    """Give a recording that a store holds the labels that the session has for it now.

    Nothing is tracked again for a texture's name. What was found wrong with it, and accepted, stays
    among its conditions.
    """
    there = stored_attributes(store, [recording.name])[recording.name]
    kinds = json.loads(there.get("conditions", "{}")).get(ACCEPTED, "")
    update_labels(store, recording.name, labels_of(recording, kinds), declared)


def _of_its_own(
    recording: Recording, declared: SessionFile, extraction: Extraction
) -> dict[str, Any]:
    """Return what is declared of a recording that is not declared of all."""
    conditions, sensor = dict(recording.conditions), extraction.sensor
    speed = recording.speed_mm_s
    own = {
        "label": None if _is_named_by_label(recording) else [recording.texture, speed],
        "steady_s": recording.steady_s if recording.steady_s != declared.steady_s else None,
        "conditions": None if conditions in ({}, {"direction": declared.direction}) else conditions,
        "fps_hz": getattr(recording.video, "rate_hz", None),
        "rest_frame": recording.rest_frame,
        "sensor": sensor.model_dump(mode="json") if recording.sensor and sensor else None,
    }
    return {name: value for name, value in own.items() if value is not None}


def _is_named_by_label(recording: Recording) -> bool:
    """Tell whether a recording's name says its texture and speed, as in the published layout."""
    texture, *others = recording.name.split("/")
    if texture != recording.texture or not others or recording.speed_mm_s is None:
        return False
    try:
        return float(others[0]) == recording.speed_mm_s
    except ValueError:
        return False

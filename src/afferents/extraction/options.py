"""The options of `extract`, and what of a recording's declaration its responses rest on."""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, InstanceOf

from afferents.choices import Method, Rest
from afferents.errors import InputError
from afferents.files import checksum
from afferents.markers.sensor import Sensor
from afferents.markers.session_sensors import Sensors
from afferents.quality.issues import Kind
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.session import Session
from afferents.store.recording import Recording
from afferents.version import __version__


class Extraction(BaseModel):
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

    model_config = ConfigDict(frozen=True)

    session: Path | InstanceOf[Session]
    out: Path
    sensor: Sensor | None = None
    method: Method = "windowed"
    keep_going: bool = False
    workers: int | None = None
    vibration: bool = True
    rest: Rest = "own"
    cluster: str | None = None
    accept: frozenset[Kind] = frozenset()
    fps_hz: float | None = None

    def as_found_anywhere(self) -> "Extraction":
        """Return it with paths that a cluster's workers find, wherever they were started.

        Raises
        ------
        InputError
            If a cluster's workers can't read the session.
        """
        if self.cluster is None:
            return self
        if not isinstance(self.session, Path):
            raise InputError(
                "--cluster: expected a session folder, which workers read, found a session made in "
                "Python; write a session.toml that names its files"
            )
        found = {"session": self.session.resolve(), "out": self.out.resolve()}
        return self.model_copy(update=found)

    def config(self, session: Session, sensors: Sensors) -> dict[str, Any]:
        """Return what must agree for recordings to stand in one store.

        `recordings` names all that the store is to hold, so that half a store is known as one.
        """
        clip = session.reference
        names = sorted({sensors.of(recording).name for recording in session.recordings})
        leads = self.rest == "reference" or self.method == "published"
        return {
            "afferents": __version__,
            "session": session.root.resolve().name,
            "declared": session.declared.model_dump(
                mode="json", exclude={"checksums", "recordings"}
            ),
            "recordings": [recording.name for recording in session.recordings],
            "sensor": sensors.usual.model_dump(mode="json"),
            **({"sensors": names} if sensors.own else {}),
            "method": self.method,
            **({} if self.vibration else {"vibration": False}),
            **({} if self.rest == "own" else {"rest": self.rest}),
            **({"reference": checksum(clip.path)} if leads and clip is not None else {}),
        }


def describe_declaration(recording: Recording, session: Session, sensors: Sensors) -> str:
    """Return, as JSON, what is declared of a recording; where that changes, it is made again."""
    own = sensors.of(recording).model_dump(mode="json") if recording.sensor else None
    declared = {
        "label": [recording.texture, recording.speed_mm_s],
        "conditions": dict(recording.conditions),
        "steady_s": recording.steady_s,
        "sensor_channel": session.declared.sensor_channel,
        "rest_frame": recording.rest_frame,
        "sensor": own,
        "fps_hz": getattr(recording.video, "rate_hz", None),
    }
    if isinstance(recording.video, ImageFolder) and recording.video.times is not None:
        declared["times"] = checksum(recording.video.times)
    if recording.beside:
        declared["beside"] = [[log.name, checksum(log.path), *log.lag] for log in recording.beside]
    return json.dumps(declared)

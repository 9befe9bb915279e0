"""From a video, or a session's videos, to marker tracks, SA-I and RA-I."""

from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.progress import Progress
from afferents.core.store import write_group
from afferents.markers import Method, Sensor, recognise_sensor, track
from afferents.pipeline.extract import Extraction, extract, marker_responses
from afferents.pipeline.inspect import Watched
from afferents.recordings import open_video


def follow_video(
    path: Path, out: Path, sensor: Sensor | None, method: Method, progress: Progress
) -> str:
    """Track one video and write a Zarr store that plain xarray reads; return what was done.

    Parameters
    ----------
    sensor
        None to recognise or estimate it.

    Raises
    ------
    InputError
        If the video or the sensor is not what it should be, or `out` is there already.
    """
    if out.exists():
        raise InputError(out, "a new store", "one that is there already", "choose another name")
    video = open_video(path)
    why = ""
    if sensor is None:
        sensor, why = recognise_sensor(video)
    tracks = track(Watched(video, progress), sensor, method)
    write_group(out, marker_responses(tracks))
    lost = 1 - float(tracks["detected"].values[sensor.rest_frame :].mean())
    return f"{why} {tracks.sizes['marker']} markers, lost for {lost:.1%} of the time.".strip()


def follow_session(
    session: Path,
    out: Path,
    sensor: Sensor,
    method: Method,
    workers: int | None,
    progress: Progress,
) -> str:
    """Track the videos of a session into a store as `extract` writes it, without vibration.

    Raises
    ------
    InputError
        As `extract`.
    """
    extract(Extraction(session, out, sensor, method, workers=workers, vibration=False), progress)
    return ""

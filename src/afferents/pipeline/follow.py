"""From a video, or a session's videos, to marker tracks, SA-I and RA-I."""

from pathlib import Path

from afferents.core.errors import InputError, PartialFailureError
from afferents.core.progress import Progress
from afferents.core.store import write_group
from afferents.markers import Method, Sensor, describe, recognise_sensor, track, undistorted
from afferents.pipeline.extract import Extraction, extract, marker_responses
from afferents.pipeline.inspect import Watched
from afferents.recordings import open_video


def follow_video(
    path: Path, out: Path, sensor: Sensor | None, method: Method, progress: Progress
) -> list[str]:
    """Track one video and write a Zarr store that plain xarray reads; say how that went.

    Parameters
    ----------
    sensor
        None to recognise or estimate it.

    Raises
    ------
    InputError
        If the video or the sensor is not what it should be, or `out` is there already.
    PartialFailureError
        If the video can't be decoded to its end; the store holds what came before.
    """
    if out.exists():
        raise InputError(out, "a new store", "one that is there already", "choose another name")
    video = open_video(path)
    why = ""
    if sensor is None:
        sensor, why = recognise_sensor(video)
    tracks = track(Watched(video, progress), sensor, method, keep_partial=True)
    write_group(out, marker_responses(undistorted(tracks, sensor.lens)))
    if tracks.attrs["stopped"]:
        kept = f"{tracks.sizes['time']} frames before that are kept in {out}, marked as stopped"
        raise PartialFailureError(f"{tracks.attrs['stopped']}; {kept}")
    return [why] * bool(why) + describe(tracks)


def follow_session(
    session: Path,
    out: Path,
    sensor: Sensor,
    method: Method,
    workers: int | None,
    progress: Progress,
) -> None:
    """Track the videos of a session into a store as `extract` writes it, without vibration.

    Raises
    ------
    InputError
        As `extract`.
    """
    extract(Extraction(session, out, sensor, method, workers=workers, vibration=False), progress)

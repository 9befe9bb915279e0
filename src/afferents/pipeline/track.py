"""From a video, or a session's videos, to marker tracks, SA-I and RA-I."""

from pathlib import Path

from afferents.core.errors import PartialFailureError
from afferents.core.outputs import require_free
from afferents.core.progress import Progress
from afferents.core.store import TRACKS, is_tracks, write_group
from afferents.markers import Method, Sensor, describe, recognise_sensor, track, undistorted
from afferents.pipeline.extract import Extraction, extract, marker_responses
from afferents.recordings import VideoWithProgress, open_video


def track_video(
    path: Path,
    out: Path,
    sensor: Sensor | None,
    method: Method,
    progress: Progress,
    force: bool = False,
) -> list[str]:
    """Track one video and write a Zarr store that plain xarray reads; say how that went.

    Parameters
    ----------
    sensor
        None to recognise or estimate it.
    force
        Whether tracks that were written there before may be replaced.

    Raises
    ------
    InputError
        If the video or the sensor is not what it should be, or `out` is not free.
    PartialFailureError
        If the video can't be decoded to its end; the store holds what came before.
    """
    require_free(out, "a video's tracks", is_tracks, force=force, reads=[path])
    video = open_video(path)
    why = ""
    if sensor is None:
        sensor, why = recognise_sensor(video)
    tracks = track(VideoWithProgress(video, progress), sensor, method, keep_partial=True)
    found = marker_responses(undistorted(tracks, sensor.lens)).assign_attrs(format=TRACKS)
    write_group(out, found)
    if tracks.attrs["stopped"]:
        kept = f"{tracks.sizes['time']} frames before that are kept in {out}, marked as stopped"
        raise PartialFailureError(f"{tracks.attrs['stopped']}; {kept}")
    return [why] * bool(why) + describe(tracks)


def track_session(
    session: Path,
    out: Path,
    sensor: Sensor,
    method: Method,
    workers: int | None,
    progress: Progress,
    cluster: str | None = None,
) -> None:
    """Track the videos of a session into a store as `extract` writes it, without vibration.

    Raises
    ------
    InputError
        As `extract`.
    """
    extraction = Extraction(
        session, out, sensor, method, workers=workers, vibration=False, cluster=cluster
    )
    extract(extraction, progress)

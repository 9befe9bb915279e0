"""From a video, or a session's videos, to marker tracks, SA-I and RA-I."""

from pathlib import Path

import xarray as xr

from afferents.choices import Method
from afferents.errors import InputError, PartialFailureError
from afferents.extraction.extract import extract_session, marker_responses
from afferents.extraction.options import Extraction
from afferents.files import Place, require_free
from afferents.markers.estimate import recognise_sensor
from afferents.markers.quality import describe, find_track_issues
from afferents.markers.sensor import Sensor, sensor_in
from afferents.markers.track import track_markers
from afferents.progress import Progress
from afferents.recordings.media import is_image_folder
from afferents.recordings.session_file import rate_in
from afferents.recordings.video import VideoWithProgress, open_clip, open_video
from afferents.store.recording import Video
from afferents.store.zarr_store import TRACKS, is_tracks, write_group


def track_into(
    source: Path,
    out: Path,
    sensor: Sensor | None,
    method: Method,
    progress: Progress,
    force: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    fps_hz: float | None = None,
) -> list[str]:
    """Track a video, or all videos of a session, into a store; say how that of one video went.

    A folder of numbered images is a video, if `fps_hz` is given. A video's store is one that plain
    xarray reads; a session's is as `extract` writes it, without vibration.

    Parameters
    ----------
    sensor
        None for what a session's file says, else ``tip_b``; of a video it is recognised or
        estimated.
    force
        Whether a video's tracks that were written there before may be replaced.
    workers, cluster
        For a session: processes here (None for one a core), or the address of a Dask scheduler.
    fps_hz
        True frame rate, where the containers' is wrong.

    Raises
    ------
    InputError
        As `extract`; if a video or the sensor is not what it should be, `out` is not free, or a
        cluster is asked for with one video.
    PartialFailureError
        If the video can't be decoded to its end; the store holds what came before.
    """
    if source.is_dir() and not is_image_folder(source):
        extraction = Extraction(
            session=source, out=out, sensor=sensor, method=method, workers=workers,
            vibration=False, cluster=cluster, fps_hz=fps_hz,
        )  # fmt: skip
        extract_session(extraction, progress)
        return []
    if cluster is not None:
        raise InputError(
            "--cluster: expected a session, whose videos go side by side, found one video"
        )
    require_free(out, is_tracks, force=force, reads=[source])
    video = open_clip(source, None if fps_hz is None else rate_in(fps_hz))
    why = ""
    if sensor is None:
        sensor, why = recognise_sensor(video)
    found = tracked(VideoWithProgress(video, progress), sensor, method, keep_partial=True)
    write_group(out, found.assign_attrs(format=TRACKS))
    if found.attrs["stopped"]:
        kept = f"{found.sizes['time']} frames before that are kept in {out}, marked as stopped"
        raise PartialFailureError(f"{found.attrs['stopped']}; {kept}")
    issues = [issue.sentence for issue in find_track_issues(found, source) if not issue.is_refused]
    return [why] * bool(why) + describe(found) + issues


def tracked(video: Video, sensor: Sensor, method: Method, keep_partial: bool = False) -> xr.Dataset:
    """Return the marker tracks of a video, as `markers.track` does, with SA-I and RA-I.

    Positions are as a lens without distortion would have shown them.

    Raises
    ------
    InputError
        As `markers.track`.
    """
    tracks = track_markers(video, sensor, method, keep_partial=keep_partial)
    return marker_responses(tracks, sensor.lens)


def track(
    video: Place | Video, sensor: "str | Path | Sensor" = "tip_b", method: Method = "windowed"
) -> xr.Dataset:
    """Follow the markers of a video.

    Parameters
    ----------
    video
        Any file that FFmpeg reads, or the video of a recording.
    sensor
        A sensor file, the name of a packaged one, or a `Sensor`.
    method
        How markers are followed from frame to frame; ``published`` keeps the reference's flaws.

    Returns
    -------
    xarray.Dataset
        `position (time, marker, space)` px, NaN where a marker was lost; `detected (time, marker)`;
        `rest_position (marker, space)`; `sa1 (time, marker)` px and `ra1 (time, marker)` px/frame.
        What the command of the same name writes.

    Raises
    ------
    InputError
        If the video can't be read, or its first frames don't show the sensor's markers.

    Examples
    --------
    >>> tracks = track("session/1/20/video.mp4", "tip_b")
    >>> dict(tracks.position.sizes)
    {'time': 45, 'marker': 361, 'space': 2}
    """
    opened = open_video(video) if isinstance(video, str | Path) else video
    return tracked(opened, sensor_in(sensor), method)

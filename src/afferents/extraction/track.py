"""From a video, or a session's videos, to marker tracks, SA-I and RA-I."""

from pathlib import Path

import xarray as xr

from afferents.choices import Method, require_workers
from afferents.errors import InputError, PartialFailureError
from afferents.extraction import extract, options
from afferents.files import Place, require_free
from afferents.markers.estimate import recognise_sensor
from afferents.markers.quality import describe, find_track_issues
from afferents.markers.sensor import Sensor, resolve_sensor
from afferents.markers.track import track_markers
from afferents.progress import Progress
from afferents.recordings import media, session_file
from afferents.recordings.video import VideoWithProgress, open_clip, open_video
from afferents.store.recording import Video
from afferents.store.zarr_store import TRACKS, is_tracks, write_group


def track_into(
    source: Path,
    out: Path,
    sensor: str | Path | Sensor | None = None,
    method: Method = "windowed",
    force: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    fps_hz: float | None = None,
    quiet: bool = False,
) -> list[str]:
    """Track the markers in a video, or in all videos of a session.

    Writes their positions, SA-I and RA-I: of a video a store that plain xarray reads, of a session
    one as 'extract' writes it, without vibration. A folder of numbered images is a video, if its
    frame rate is given.

    Parameters
    ----------
    source
        A video (or folder of images), or a session.
    out
        Store (Zarr) to write, such as OUT.zarr.
    sensor
        Sensor file (TOML) or name (default: recognised from a video; what its file names, else
        tip_b, for a session).
    method
        How markers are matched from frame to frame; 'published' repeats the reference code, flaws
        included.
    force
        Overwrite a video's tracks that this command wrote there before (nothing else).
    workers
        Processes to run in parallel (default: one per core).
    cluster
        Run on a Dask cluster instead, such as tcp://scheduler:8786.
    fps_hz
        True frame rate of the videos, frames a second, where their files say another; times then
        count from it (default: what the session file says, else the files).
    quiet
        No progress bars; plain lines on stderr.

    Raises
    ------
    InputError
        As `extract`; if a video or the sensor is not what it should be, `out` is not free, or a
        cluster is given with one video.
    PartialFailureError
        If the video can't be decoded to its end; the store holds what came before.
    """
    require_workers(workers)
    given = None if sensor is None else resolve_sensor(sensor)
    if source.is_dir() and not media.is_image_folder(source):
        extraction = options.Extraction(
            session=source, out=out, sensor=given, method=method, workers=workers,
            vibration=False, cluster=cluster, fps_hz=fps_hz,
        )  # fmt: skip
        with Progress(quiet) as progress:
            extract.extract_session(extraction, progress)
        return []
    if cluster is not None:
        raise InputError(
            "--cluster: expected a session, whose videos go side by side, found one video"
        )
    require_free(out, is_tracks, force=force, reads=[source])
    video = open_clip(source, None if fps_hz is None else session_file.parse_rate(fps_hz))
    why = ""
    if given is None:
        given, why = recognise_sensor(video)
    with Progress(quiet) as progress:
        shown = VideoWithProgress(video, progress)
        tracks = track_markers(shown, given, method, keep_partial=True)
    found = extract.marker_responses(tracks, given)
    write_group(out, found.assign_attrs(format=TRACKS))
    if found.attrs["stopped"]:
        kept = f"{found.sizes['time']} frames before that are kept in {out}, marked as stopped"
        raise PartialFailureError(f"{found.attrs['stopped']}; {kept}")
    issues = [issue.sentence for issue in find_track_issues(found, source) if not issue.is_refused]
    return [why] * bool(why) + describe(found) + issues


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
    given = resolve_sensor(sensor)
    return extract.marker_responses(track_markers(opened, given, method), given)

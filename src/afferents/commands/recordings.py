"""Commands of recordings: look at them, calibrate their sensor, track, extract."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from afferents.commands.given import Data, Place, sensor_in
from afferents.core.choices import Method, Rest
from afferents.core.doubt import kinds_named
from afferents.core.progress import Progress
from afferents.core.recording import Video
from afferents.core.responses import Responses
from afferents.core.store import open_responses, store_config

if TYPE_CHECKING:
    from afferents.markers import Sensor
    from afferents.pipeline.init import FirstSession
    from afferents.pipeline.inspect_files import Inspection
    from afferents.recordings import Session


def inspect(
    source: Data,
    out: Place | None = None,
    sensor: "str | Path | Sensor | None" = None,
    overlay: Place | None = None,
    force: bool = False,
    quiet: bool = False,
    fps_hz: float | None = None,
) -> "Inspection":
    """Say what is in a file or session and whether it is sound, and draw pictures of it.

    Parameters
    ----------
    source
        A video, a wav file, a session, a store, a ``dataset.toml``, ``fabricslide:PATH``, or
        a `DataSet` of your own.
    out
        Folder for the pictures; None for ``NAME-inspected``.
    sensor
        Whose markers to look for.
    overlay
        Video to write with the markers drawn in, such as ``o.mp4``; None for none.
    force
        Whether one that was written there before may be replaced.
    quiet
        Whether no progress is shown.
    fps_hz
        True frame rate of the video or of a session's, where their containers' is wrong.

    Returns
    -------
    Inspection
        Sentences, problems, pictures and facts.

    Raises
    ------
    InputError
        If there is nothing that can be read, or the folder for the pictures holds something else.

    Examples
    --------
    >>> found = inspect("session/1/20/audio.wav", out="pictures")
    >>> [picture.name for picture in found.pictures]
    ['vibration.png']
    """
    from afferents.pipeline.inspect import inspect as look

    name = Path(str(source).rpartition(":")[2].rstrip("/")).stem or "source"
    given = None if sensor is None else sensor_in(sensor)
    folder = Path(out) if out is not None else Path(f"{name}-inspected")
    drawn = None if overlay is None else Path(overlay)
    with Progress(quiet) as progress:
        return look(source, folder, given, progress, drawn, force, fps_hz)


def init_session(folder: Place, force: bool = False) -> "FirstSession":
    """Write a first `session.toml` into a folder of recordings, or `dataset.toml` beside tables.

    Parameters
    ----------
    folder
        Holds videos of any container, sound, or folders of numbered images; or tables alone.
    force
        Whether one that was written so before may be replaced.

    Returns
    -------
    FirstSession
        The `path` of the file, and `sentences` on what was guessed and is to be checked.

    Raises
    ------
    InputError
        If there are no recordings in the folder, or a session file is there.

    Examples
    --------
    >>> made = init_session("clips")
    >>> made.path.name
    'session.toml'
    """
    from afferents.pipeline.init import first_session

    return first_session(Path(folder), force)


def calibrate(
    video: Place | Sequence[Place],
    out: Place,
    pitch_mm: float | None = None,
    force: bool = False,
) -> "Sensor":
    """Find out how a sensor's markers look and what layout they form; write its sensor file.

    Parameters
    ----------
    video
        A clip that begins with the skin at rest, or several of the same sensor.
    out
        Sensor file to write, ending in ``.toml``; a picture to check comes beside it.
    pitch_mm
        Distance of the markers on the skin, mm, if known.
    force
        Whether those of an earlier calibration may be replaced.

    Returns
    -------
    Sensor
        What was written, to be given as ``sensor`` to the other functions.

    Raises
    ------
    InputError
        If the clip can't be read, shows no markers, or one of the files to write is there already.

    Examples
    --------
    >>> sensor = calibrate("session/1/20/video.mp4", "mine.toml", pitch_mm=1.0)
    >>> sensor.n_markers
    361
    """
    from afferents.markers import load_sensor
    from afferents.pipeline.calibrate import calibrate_sensor

    clips = [video] if isinstance(video, str | Path) else video
    calibrate_sensor([Path(clip) for clip in clips], Path(out), pitch_mm, force)
    return load_sensor(str(out))


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
    from afferents.pipeline.track import tracked
    from afferents.recordings import open_video

    opened = open_video(video) if isinstance(video, str | Path) else video
    return tracked(opened, sensor_in(sensor), method)


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
    """Turn videos and audio into marker tracks, SA-I, RA-I and RA-II.

    Parameters
    ----------
    session
        Session folder: in the published layout, ``<texture>/<speed>/video.mp4`` and ``audio.wav``,
        or with a ``session.toml``; or a `Session`, such as `Session.from_table` makes.
    out
        Store to write, such as ``S.zarr``; recordings that are in it are kept.
    sensor, method
        Whose markers they are (None for what the session file says, else ``tip_b``), and how they
        are followed.
    rest
        Whether SA-I counts from each recording's own rest frame, or from the ``reference`` clip.
    keep_going
        Whether recordings that can't be read are skipped.
    accept
        Kinds of what is wrong with a recording that are taken all the same.
    workers, cluster
        Processes here (None for one a core), or the address of a Dask scheduler.
    quiet
        Whether no progress is shown.
    fps_hz
        True frame rate of all videos, where their containers' is wrong: times then count from it.

    Returns
    -------
    Extracted
        A list of `xarray.Dataset`, a recording each, opened lazily; see `afferents.core.responses`
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
    from afferents.pipeline.extract import extract as run
    from afferents.pipeline.extraction import Extraction

    wanted = Extraction(
        Path(session) if isinstance(session, str | Path) else session, Path(out),
        None if sensor is None else sensor_in(sensor), method, keep_going, workers, rest=rest,
        cluster=cluster, accept=kinds_named(list(accept)), fps_hz=fps_hz,
    )  # fmt: skip
    with Progress(quiet) as progress:
        skipped = run(wanted, progress)
    nothing = len(skipped) == len(store_config(Path(out))["recordings"])
    return Extracted([] if nothing else open_responses(Path(out)), skipped)

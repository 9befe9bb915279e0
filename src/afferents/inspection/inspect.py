"""Check a file, a session or a store: what it holds, whether it is sound, and a picture of it."""

from pathlib import Path

from afferents.errors import InputError
from afferents.files import Place, is_our_picture, require_free
from afferents.inspection import files, sessions, stores
from afferents.markers.sensor import Sensor, resolve_sensor
from afferents.progress import Progress
from afferents.recordings import data_sets, described
from afferents.recordings.data_set import Data, DataSet
from afferents.recordings.media import is_image_folder, is_sound
from afferents.reporting.overlay import is_overlay


def inspect(
    source: Data,
    out: Place | None = None,
    sensor: str | Path | Sensor | None = None,
    overlay: Place | None = None,
    force: bool = False,
    quiet: bool = False,
    fps_hz: float | None = None,
) -> files.Inspection:
    """Check a file or a session: what it holds, whether it is sound, and a picture of it.

    Parameters
    ----------
    source
        A video (or folder of images), sound, a session folder, a store, a dataset.toml or
        fabricslide:PATH. In Python a `DataSet`.
    out
        Folder for the pictures (default: NAME-inspected).
    sensor
        Sensor file (TOML), or the name of a packaged one.
    overlay
        Video to write with the tracked markers drawn in, such as o.mp4.
    force
        Overwrite what this command wrote there before (nothing else).
    quiet
        No progress bars; plain lines on stderr.
    fps_hz
        True frame rate of the videos, frames a second, where their files say another; times then
        count from it (default: what the session file says, else the files).

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
    given = None if sensor is None else resolve_sensor(sensor)
    drawn = None if overlay is None else Path(overlay)
    if out is None:
        out = f"{Path(str(source).rpartition(':')[2].rstrip('/')).stem or 'source'}-inspected"
    out = Path(out)
    path = source.path if isinstance(source, DataSet) else Path(source)
    is_heard = is_sound(path)
    is_clip = (path.is_file() or is_image_folder(path)) and not described.Described.recognises(path)
    if drawn is not None and (is_heard or not is_clip):
        raise InputError(f"--overlay: expected a video to draw markers into, found '{source}'")
    for name in (files.MARKERS, files.RESPONSES, files.VIBRATION, stores.STEADINESS):
        require_free(out / name, is_our_picture)
    if drawn is not None:
        require_free(drawn, is_overlay, force=force, reads=[path])
    if is_heard and is_clip and fps_hz is not None:
        raise InputError(f"--fps: expected a video, or a session of videos, found '{source}'")
    with Progress(quiet) as progress:
        if is_clip and not isinstance(source, DataSet):
            if is_heard:
                return files.inspect_wav(path, out)
            return files.inspect_video(path, out, given, progress, drawn, fps_hz)
        data_set = data_sets.data_set_of(source)
        data_set = data_set if fps_hz is None else data_set.at_rate(fps_hz)
        if data_set.path == path and not path.exists():
            raise InputError(
                f"{path}: expected a video, a wav file, a session or a store, found nothing there"
            )
        stored = data_set.responses()
        if stored is not None:
            return stores.inspect_responses(str(source), data_set, stored, out)
        return sessions.inspect_recordings(str(source), data_set, out, progress, given)

"""What is in a file or session, whether it is sound, and a picture of it."""

from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.outputs import require_free, require_pictures_free
from afferents.core.progress import Progress
from afferents.markers import Sensor
from afferents.pipeline.inspection.data import inspect_recordings, inspect_responses
from afferents.pipeline.inspection.found import MARKERS, RESPONSES, VIBRATION, Inspection
from afferents.pipeline.inspection.sound import inspect_wav
from afferents.pipeline.inspection.video import inspect_video
from afferents.recordings import DataSet, data_set_of
from afferents.reporting import is_overlay


def inspect(
    source: str | Path | DataSet,
    out: Path,
    sensor: Sensor | None,
    progress: Progress,
    overlay: Path | None = None,
    force: bool = False,
) -> Inspection:
    """Look at a video, a wav file, a session, a store or another data set.

    Parameters
    ----------
    out
        Folder for the pictures.
    sensor
        For a video; None to recognise or estimate it.
    overlay
        For a video; where to write it with its markers drawn in.
    force
        Whether an overlay that was written there before may be replaced.

    Raises
    ------
    InputError
        If there is nothing there, or nothing that can be read.
    """
    path = source.path if isinstance(source, DataSet) else Path(source)
    is_wav = path.suffix.lower() == ".wav"
    if overlay is not None and (is_wav or not path.is_file()):
        raise InputError("--overlay", "a video to draw markers into", f"'{source}'")
    require_pictures_free(out, MARKERS, RESPONSES, VIBRATION)
    if overlay is not None:
        require_free(overlay, "a video with its markers", is_overlay, force=force, reads=[path])
    if not isinstance(source, DataSet) and path.is_file():
        return (
            inspect_wav(path, out)
            if is_wav
            else inspect_video(path, out, sensor, progress, overlay)
        )
    data_set = data_set_of(source)
    if data_set.path == path and not path.exists():
        raise InputError(path, "a video, a wav file, a session or a store", "nothing there")
    stored = data_set.responses()
    if stored is not None:
        return inspect_responses(str(source), data_set, stored)
    return inspect_recordings(str(source), data_set, out, progress)

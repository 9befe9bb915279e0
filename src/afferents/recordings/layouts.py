"""The published layout: ``<texture>/<speed>/video.mp4`` and ``audio.wav``.

Layout (preprocess/process.ipynb, cells 2-3; vibrotactile/process_vibration.ipynb, cells 2-3):
texture folders ``0 0.5 ... 6`` (bump spacing, mm), speed folders ``10 20 ... 100`` (mm/s), the
marker reference ``throw_away.mp4`` in the first of them, ``0/10``. Repetitions are one folder
deeper: ``<texture>/<speed>/<repetition>/``. The video may be in any container (``video.avi``),
or a folder of numbered images, ``video/``.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from afferents.errors import InputError
from afferents.recordings.audio import WavFile
from afferents.recordings.media import is_video
from afferents.recordings.pictures import ZIP, ImageFolder, times_beside
from afferents.recordings.session_file import (
    SESSION_FILE,
    SESSION_TOML,
    SessionFile,
    session_file,
)
from afferents.recordings.video import VideoFile
from afferents.store.recording import Recording, Video

VIDEO, AUDIO, REFERENCE = "video.mp4", "audio.wav", "throw_away.mp4"

_POSITIVE = re.compile(r"\d+(\.\d+)?")


def published(root: Path, declared: SessionFile) -> list[Recording]:
    """Return the recordings of a folder in the published layout, in no order; none is opened.

    Raises
    ------
    InputError
        If a folder is not named by a speed, or holds two videos or recordings within a recording.
    """
    return [_recording(root, folder, declared) for folder in recording_folders(root)]


def recording_folders(root: Path) -> Iterator[Path]:
    """Yield the folders of recordings in the published layout, of whatever names."""
    for texture in _folders(root):
        for speed in _folders(texture):
            repetitions = [folder for folder in _folders(speed) if _is_recorded(folder)]
            if _is_recorded(speed):
                if repetitions:
                    raise InputError(
                        f"{speed}: expected a recording, or repetitions of it in folders of their "
                        f"own, found both ({repetitions[0].name} among them); move its files into "
                        "a folder of its own"
                    )
                yield speed
            yield from repetitions


def _folders(parent: Path) -> list[Path]:
    return [path for path in parent.iterdir() if path.is_dir() and not path.name.startswith(".")]


def _is_recorded(folder: Path) -> bool:
    return find_video(folder) is not None or (folder / AUDIO).is_file()


def find_video(folder: Path) -> Path | None:
    """Return the folder's video, in whatever container, or of images."""
    usual = folder / VIDEO
    if usual.is_file():  # most are
        return usual
    stem = usual.stem
    found = [
        path
        for path in sorted(folder.glob(f"{stem}*"))
        if path.stem == stem and (path.is_dir() if path.name == stem else is_video(path))
    ]
    if len(found) > 1:
        names = " and ".join(path.name for path in found)
        raise InputError(f"{folder}: expected one video, found {names}; move one of them elsewhere")
    return found[0] if found else None


def _recording(root: Path, folder: Path, declared: SessionFile) -> Recording:
    texture, speed, *repetition = folder.relative_to(root).parts
    if not _POSITIVE.fullmatch(speed) or float(speed) == 0:
        where = root / texture / speed
        raise InputError(f"{where}: expected a folder named by its speed in mm/s, found '{speed}'")
    again = {"repetition": repetition[0]} if repetition else {}
    video, audio = find_video(folder), folder / AUDIO
    return Recording(
        name="/".join((texture, speed, *repetition)),
        texture=texture,
        speed_mm_s=float(speed),
        source=folder,
        video=make_clip(video, declared) if video else None,
        audio=WavFile(audio, declared.channel) if audio.is_file() else None,
        steady_s=declared.steady_s,
        conditions={"direction": declared.direction, **declared.conditions, **again},
        rest_frame=declared.rest_frame,
        named_by_spacing=True,
    )


def make_clip(
    path: Path, declared: SessionFile, own_hz: float | None = None, times: Path | None = None
) -> Video:
    """Return a video, or images as one; `own_hz` and the CSV `times` apply to it alone."""
    true_hz = own_hz or (declared.fps_hz if declared.fps_overrules else None)
    if not (path.is_dir() or path.suffix.lower() == ZIP):
        return VideoFile(path, true_hz)
    times = times or times_beside(path)
    if times is None and "fps_hz" in declared.model_fields_set:
        true_hz = true_hz or declared.fps_hz
    return ImageFolder(path, true_hz, times)


def session_around(path: Path) -> tuple[SessionFile, float | None]:
    """Return what the session says in which a video or sound lies, and the video's own rate, Hz.

    Where there is no session, no channel; where it names no rate for this video, no rate.
    """
    path = path.absolute()
    for folder in path.parents:
        if (folder / SESSION_TOML).is_file() or (folder / SESSION_FILE).is_file():
            declared = session_file(folder)
            own = (r.fps_hz for r in declared.recordings if path == folder / (r.video or ""))
            return declared, next(own, None)
    return SessionFile(sensor_channel=None), None

"""The published layout: ``<texture>/<speed>/video.mp4`` and ``audio.wav``.

Layout (preprocess/process.ipynb, cells 2-3; vibrotactile/process_vibration.ipynb, cells 2-3):
texture folders ``0 0.5 ... 6`` (bump spacing, mm), speed folders ``10 20 ... 100`` (mm/s),
the marker reference ``throw_away.mp4`` in the first of them, ``0/10``. Repetitions are one folder
deeper: ``<texture>/<speed>/<repetition>/``. The video may be in any container (``video.avi``), or a
folder of numbered images, ``video/``.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.recording import Recording, Vibration, Video
from afferents.recordings.audio import WavFile
from afferents.recordings.listed import images, overruling, sensor_channel
from afferents.recordings.media import is_video
from afferents.recordings.session_file import SessionFile
from afferents.recordings.video import VideoFile

VIDEO, AUDIO, REFERENCE = "video.mp4", "audio.wav", "throw_away.mp4"
NOT_TEXTURES = frozenset({"processed", "models", "figures", "static", "dynamic"})
"""Folders that the published code writes beside the textures."""

_POSITIVE = re.compile(r"\d+(\.\d+)?")


def published(root: Path, declared: SessionFile) -> list[Recording]:
    """Return the recordings of a folder in the published layout, in no order; none is opened.

    Raises
    ------
    InputError
        If a folder is not named by a speed, or holds two videos or recordings within a recording.
    """
    return [_recording(root, folder, declared) for folder in _conditions(root)]


def _conditions(root: Path) -> Iterator[Path]:
    for texture in _folders(root):
        if texture.name in NOT_TEXTURES:
            continue
        for speed in _folders(texture):
            repetitions = [folder for folder in _folders(speed) if _is_recorded(folder)]
            if _is_recorded(speed):
                _require_alone(speed, repetitions)
                yield speed
            yield from repetitions


def _folders(parent: Path) -> list[Path]:
    return [path for path in parent.iterdir() if path.is_dir() and not path.name.startswith(".")]


def _is_recorded(folder: Path) -> bool:
    return _video_in(folder) is not None or (folder / AUDIO).is_file()


def _video_in(folder: Path) -> Path | None:
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
        raise InputError(folder, "one video", names, "move one of them elsewhere")
    return found[0] if found else None


def _require_alone(folder: Path, inside: list[Path]) -> None:
    if inside:
        raise InputError(
            folder,
            "a recording, or repetitions of it in folders of their own",
            f"both ({inside[0].name} among them)",
            "move its files into a folder of its own",
        )


def _recording(root: Path, folder: Path, declared: SessionFile) -> Recording:
    texture, speed, *repetition = folder.relative_to(root).parts
    if not _POSITIVE.fullmatch(speed) or float(speed) == 0:
        where = root / texture / speed
        raise InputError(where, "a folder named by its speed in mm/s", f"'{speed}'")
    direction = {"direction": declared.direction}
    again = {"repetition": repetition[0]} if repetition else {}
    return Recording(
        name="/".join((texture, speed, *repetition)),
        texture=texture,
        speed_mm_s=float(speed),
        source=folder,
        video=_video(folder, declared),
        audio=_audio(folder / AUDIO, sensor_channel(declared)),
        steady_s=declared.steady_s,
        conditions={**direction, **declared.conditions, **again},
        rest_frame=declared.rest_frame,
        named_by_spacing=True,
    )


def _video(folder: Path, declared: SessionFile) -> Video | None:
    path = _video_in(folder)
    if path is not None and path.is_dir():
        said = "fps_hz" in declared.model_fields_set
        return images(path, declared.fps_hz if said else None, declared)
    return None if path is None else VideoFile(path, overruling(declared))


def reference_in(recording: Recording) -> Video | None:
    """Return the video that fixes the order of the markers, beside the first recording."""
    path = recording.source / REFERENCE
    return VideoFile(path) if path.is_file() else None


def _audio(path: Path, channel: int) -> Vibration | None:
    return WavFile(path, channel) if path.is_file() else None

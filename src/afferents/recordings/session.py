"""The session folder: ``<texture>/<speed>/video.mp4`` and ``audio.wav``, as published.

Layout (preprocess/process.ipynb, cells 2-3; vibrotactile/process_vibration.ipynb, cells 2-3):
texture folders ``0 0.5 ... 6`` (bump spacing, mm), speed folders ``10 20 ... 100`` (mm/s),
the marker reference ``throw_away.mp4`` in the first of them, ``0/10``.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from afferents.core.doubt import KINDS, Doubt
from afferents.core.errors import InputError
from afferents.core.recording import (
    Recording,
    Session,
    Vibration,
    Video,
    natural_order,
    require_distinct,
)
from afferents.recordings.audio import WavFile
from afferents.recordings.check import check_recording
from afferents.recordings.data_set import DataSet
from afferents.recordings.session_file import SESSION_FILE, SessionFile, session_file
from afferents.recordings.video import VideoFile

VIDEO, AUDIO, REFERENCE = "video.mp4", "audio.wav", "throw_away.mp4"
NOT_TEXTURES = frozenset({"processed", "models", "figures", "static", "dynamic"})
"""Folders that the published code writes beside the textures."""

_POSITIVE = re.compile(r"\d+(\.\d+)?")


class PublishedSession(DataSet):
    """A session folder in the published layout: see `read_session`."""

    name, title = "session", "A session"
    extracted_first = True

    @classmethod
    def is_at(cls, path: Path) -> bool:
        """Take any folder for one: what it lacks is said when it is read."""
        return path.is_dir()

    def recordings(self) -> Session:
        """Return a recording a condition."""
        return read_session(self.path)

    def check(self, recording: Recording) -> list[Doubt]:
        """Return what differs from the session's own declaration."""
        return check_recording(recording, session_file(self.path), KINDS)

    def describe(self, session: Session) -> list[str]:
        """Say what the order of the markers comes from."""
        return [
            "The order of markers comes from throw_away.mp4."
            if session.reference
            else "There is no throw_away.mp4; it is needed only by the published tracker."
        ]


def read_session(root: str | Path) -> Session:
    """Read a session folder; no video or audio is opened until it is asked for.

    A condition is a folder two levels down that holds `video.mp4` or `audio.wav`; folders
    without conditions, hidden ones and `NOT_TEXTURES` are ignored. Only the grid is checked
    here; `check_recording` checks one recording.

    Returns
    -------
    Session
        Recordings named ``<texture>/<speed>``, by texture in natural order, then by speed.

    Raises
    ------
    InputError
        If the folder is missing or unreadable, holds no condition, has a condition whose
        folder is not named by a speed, its grid has a hole that `session.json` does not
        declare, or some conditions have a video (or audio) and others have none.
    """
    root = Path(root)
    if not root.is_dir():
        raise InputError(root, "a session folder", "a file" if root.exists() else "no such folder")
    declared = session_file(root)
    try:
        folders = list(_conditions(root))
    except OSError as error:
        raise InputError(
            error.filename or root, "a readable folder", f"{error.strerror}"
        ) from error
    if not folders:
        raise InputError(
            root, f"conditions <texture>/<speed>/ with {VIDEO} or {AUDIO}", "none of them"
        )
    recordings = sorted((_recording(folder, declared) for folder in folders), key=_grid_order)
    _check_grid(root, recordings, declared)
    return Session(root, tuple(recordings), _video(recordings[0].source / REFERENCE))


def _conditions(root: Path) -> Iterator[Path]:
    for texture in _folders(root):
        if texture.name not in NOT_TEXTURES:
            yield from (
                speed
                for speed in _folders(texture)
                if (speed / VIDEO).is_file() or (speed / AUDIO).is_file()
            )


def _folders(parent: Path) -> list[Path]:
    return [path for path in parent.iterdir() if path.is_dir() and not path.name.startswith(".")]


def _recording(folder: Path, declared: SessionFile) -> Recording:
    texture, speed = folder.parent.name, folder.name
    if not _POSITIVE.fullmatch(speed) or float(speed) == 0:
        raise InputError(folder, "a folder named by its speed in mm/s", f"'{speed}'")
    return Recording(
        name=f"{texture}/{speed}",
        texture=texture,
        speed_mm_s=float(speed),
        source=folder,
        video=_video(folder / VIDEO),
        audio=_audio(folder / AUDIO, declared.sensor_channel),
        steady_s=declared.steady_s,
        conditions={"direction": declared.direction},
    )


def _video(path: Path) -> Video | None:
    return VideoFile(path) if path.is_file() else None


def _audio(path: Path, channel: int) -> Vibration | None:
    return WavFile(path, channel) if path.is_file() else None


def _grid_order(recording: Recording) -> tuple[tuple[float, str], float]:
    return natural_order(recording.texture), recording.speed_mm_s


def _check_grid(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    folders = {(r.source.name, r.speed_mm_s) for r in recordings}
    require_distinct(root, (r.texture for r in recordings), folders)
    present = {(r.texture, r.speed_mm_s) for r in recordings}
    expected = {(texture, speed) for texture, _ in present for _, speed in present}
    missing = sorted(
        expected - present - set(declared.holes), key=lambda c: (natural_order(c[0]), c[1])
    )
    if missing:
        names = ", ".join(f"{texture}/{speed:g}" for texture, speed in missing)
        raise InputError(
            root,
            "a recording of every texture at every speed",
            f"none in {names}",
            f"record what is missing or declare it in {SESSION_FILE} as 'holes'",
        )
    _check_all_or_none(root, VIDEO, {r.name: r.video is not None for r in recordings})
    _check_all_or_none(root, AUDIO, {r.name: r.audio is not None for r in recordings})


def _check_all_or_none(root: Path, file: str, has: Mapping[str, bool]) -> None:
    """Refuse a file that only some conditions have: models would be left out for all."""
    lacking = [name for name, there in has.items() if not there]
    if 0 < len(lacking) < len(has):
        raise InputError(
            root,
            f"{file} in every condition or in none",
            f"none in {', '.join(lacking)}",
            "record what is missing, or move these folders away and declare them in "
            f"{SESSION_FILE} as 'holes'",
        )

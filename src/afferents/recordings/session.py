"""The session folder: ``<texture>/<speed>/video.mp4`` and ``audio.wav``, as published.

Layout (preprocess/process.ipynb, cells 2-3; vibrotactile/process_vibration.ipynb, cells 2-3):
texture folders ``0 0.5 ... 6`` (bump spacing, mm), speed folders ``10 20 ... 100`` (mm/s),
the marker reference ``throw_away.mp4`` in the first of them, ``0/10``.
"""

import hashlib
import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from afferents.core.documents import as_form, read_json
from afferents.core.doubt import Doubt, Kind, accepted
from afferents.core.errors import InputError
from afferents.core.files import checksum
from afferents.core.recording import (
    Recording,
    Session,
    Vibration,
    Video,
    natural_order,
    require_distinct,
)
from afferents.recordings.audio import WavFile
from afferents.recordings.video import VideoFile

SESSION_FILE = "session.json"
VIDEO, AUDIO, REFERENCE = "video.mp4", "audio.wav", "throw_away.mp4"
NOT_TEXTURES = frozenset({"processed", "models", "figures", "static", "dynamic"})
"""Folders that the published code writes beside the textures."""

SHORTER_AUDIO_S = 0.5
"""How much shorter than the video the audio may be, s."""
LONGER_AUDIO_S, LONGER_AUDIO = 1.0, 0.05
"""How much longer, s and as a share of the video: recorders are started and stopped one after the
other, by hand or by a script. Half a video is found from 2.2 s of sound on."""

RATE_TOLERANCE = 0.1
"""How far a video's nominal frame rate may lie from the declared one, as a share of it."""

_POSITIVE = re.compile(r"\d+(\.\d+)?")


class SessionFile(BaseModel):
    """What `session.json` declares; the defaults are the published recordings.

    Other fields (sensor, versions) may stand in the file and are not looked at.

    Attributes
    ----------
    sample_rate_hz, audio_channels
        Rate and channels of every `audio.wav`.
    sensor_channel
        The sensor's channel, from 0 (published: the second).
    fps_hz
        Nominal frame rate of every `video.mp4`, within 10 %; the true frame times are the
        container's.
    frame_width, frame_height
        Size of every `video.mp4`, px.
    steady_s
        Start and end of constant speed in each recording, s; null where unknown.
    holes
        ``[texture, speed]`` of each condition of the grid that was never recorded.
    direction
        Direction in which the texture slides in the image, ``+x``, ``-x``, ``+y`` or ``-y``.
    simulated
        Whether a simulation made the recordings.
    checksums
        SHA-256 (hex) of files, by recording and file: ``{"3/50": {"video.mp4": ...}}``.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    sample_rate_hz: float = Field(44100, gt=0)
    audio_channels: int = Field(2, ge=1)
    sensor_channel: int = Field(1, ge=0, validate_default=True)
    fps_hz: float = Field(90, gt=0)
    frame_width: int = Field(640, ge=1)
    frame_height: int = Field(480, ge=1)
    steady_s: tuple[float, float] | None = None
    holes: tuple[tuple[str, float], ...] = ()
    direction: str = Field("+x", pattern=r"^[+-][xy]$")
    simulated: bool = False
    checksums: Mapping[str, Mapping[str, str]] = Field(default_factory=dict)

    def of(self, name: str) -> "SessionFile":
        """Return what it says of one recording, light enough to be sent along with it."""
        sums = {name: self.checksums[name]} if name in self.checksums else {}
        return self.model_copy(update={"checksums": sums, "holes": ()})

    @field_validator("holes", mode="before")
    @classmethod
    def _textures_may_be_numbers(cls, holes: object) -> object:
        if not isinstance(holes, list | tuple):
            return holes
        return tuple(_named(hole) for hole in holes)

    @field_validator("sensor_channel")
    @classmethod
    def _sensor_is_on_a_channel(cls, channel: int, info: ValidationInfo) -> int:
        if channel >= info.data.get("audio_channels", channel + 1):
            raise ValueError("counted from 0, below audio_channels")
        return channel

    @field_validator("steady_s")
    @classmethod
    def _steady_is_an_interval(cls, steady: tuple[float, float] | None) -> object:
        if steady is not None and not 0 <= steady[0] < steady[1]:
            raise ValueError("steady_s is [start, stop] with 0 <= start < stop")
        return steady


def _named(hole: object) -> object:
    """Return ``[texture, speed]`` with the texture as a folder name."""
    if isinstance(hole, list | tuple) and len(hole) == 2:
        texture, speed = hole
        return (f"{texture:g}" if type(texture) in (int, float) else texture, speed)
    return hole


def session_file(root: Path) -> SessionFile:
    """Read `session.json`, or return the published defaults where there is none.

    Raises
    ------
    InputError
        If it is not JSON, or a field is not what it should be.
    """
    path = root / SESSION_FILE
    if not path.exists():
        return SessionFile()
    return as_form(read_json(path, "a session file"), SessionFile, path, "a session file")


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


def require_own_files(session: Session) -> None:
    """Refuse recordings that share a file: one recorded once and copied, or laid in twice.

    Only files of one size are read, so that a session of any size is looked at but once.

    Raises
    ------
    InputError
        Naming two files of the same bytes.
    """
    by_size: dict[tuple[str, int], list[Path]] = {}
    for path in (path for recording in session.recordings for path in recording.files):
        by_size.setdefault((path.name, _size(path)), []).append(path)
    seen: dict[str, Path] = {}
    for (_, size), paths in by_size.items():
        for path in paths if size and len(paths) > 1 else ():  # empty ones are no recordings
            other = seen.setdefault(_checksum(path), path)
            if other != path:
                raise InputError(
                    path,
                    "a recording of its own",
                    f"the same bytes as {other}",
                    "remove the copy, or record what is missing",
                )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError as error:
        raise InputError(path, "a readable file", f"{error.strerror}") from error


def _checksum(path: Path) -> str:
    try:
        return checksum(path)
    except OSError as error:
        raise InputError(path, "a readable file", f"{error.strerror}") from error


def check_files(recording: Recording, declared: SessionFile) -> str:
    """Compare a recording's files with the checksums that its session declares.

    Returns
    -------
    str
        SHA-256 over those of its files: what tells these files from others.

    Raises
    ------
    InputError
        If a file can't be read, or is not the one that was declared.
    """
    expected = declared.checksums.get(recording.name, {})
    found = {path.name: _checksum(path) for path in recording.files}
    for path in recording.files:
        if expected.get(path.name, found[path.name]) != found[path.name]:
            raise InputError(
                path,
                f"the file whose checksum {SESSION_FILE} declares",
                "another",
                "bring it back, or take its checksum out if it was changed on purpose",
            )
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()


def check_recording(
    recording: Recording, declared: SessionFile, accept: Collection[Kind] = ()
) -> list[Doubt]:
    """Check one recording of a session folder by its headers.

    Returns
    -------
    What is wrong with it and accepted.

    Raises
    ------
    InputError
        If a file is unreadable, the video of another size or frame rate than declared, the
        audio of another rate or with other channels, or (unless `length` is accepted) more than
        0.5 s shorter than the video, or more than 1 s and 5% longer.
    """
    video, audio = recording.video, recording.audio
    if isinstance(video, VideoFile):
        _check_video(video, declared)
    if isinstance(audio, WavFile):
        _check_audio(audio, declared)
    if isinstance(video, VideoFile) and isinstance(audio, WavFile):
        return accepted(_doubt_lengths(video, audio), accept)
    return []


def _check_video(video: VideoFile, declared: SessionFile) -> None:
    expected = (declared.frame_width, declared.frame_height)
    if (video.width, video.height) != expected:
        raise InputError(
            video.path,
            f"frames of {expected[0]}x{expected[1]} px",
            f"{video.width}x{video.height}",
            f"declare frame_width and frame_height in {SESSION_FILE}",
        )
    if abs(video.fps_hz - declared.fps_hz) > RATE_TOLERANCE * declared.fps_hz:
        raise InputError(
            video.path,
            f"about {declared.fps_hz:g} frames a second",
            f"{video.fps_hz:g}",
            f"declare fps_hz in {SESSION_FILE}",
        )


def _check_audio(audio: WavFile, declared: SessionFile) -> None:
    if (audio.sample_rate_hz, audio.n_channels) != (
        declared.sample_rate_hz,
        declared.audio_channels,
    ):
        raise InputError(
            audio.path,
            f"{declared.audio_channels} channel(s) at {declared.sample_rate_hz:g} Hz",
            f"{audio.n_channels} at {audio.sample_rate_hz:g} Hz",
            f"declare audio_channels and sample_rate_hz in {SESSION_FILE}",
        )


def _doubt_lengths(video: VideoFile, audio: WavFile) -> list[Doubt]:
    video_s, audio_s = video.duration_s, audio.n_samples / audio.sample_rate_hz
    least_s = video_s - SHORTER_AUDIO_S
    most_s = video_s * (1 + LONGER_AUDIO) + LONGER_AUDIO_S
    if least_s <= audio_s and (audio_s <= most_s or video_s == 0):  # 0: none is declared
        return []
    bound = f"at least {least_s:.2f}" if audio_s < least_s else f"at most {most_s:.2f}"
    expected = f"audio of {bound} s, for a video of {video_s:.2f} s"
    return [Doubt("length", audio.path, expected, f"{audio_s:.2f} s")]

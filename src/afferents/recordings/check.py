"""Whether the files of a session folder are what its `session.json` declares, and each its own."""

import hashlib
import json
from collections.abc import Collection
from pathlib import Path

from afferents.core.doubt import Doubt, Kind, accepted
from afferents.core.errors import InputError
from afferents.core.files import checksum
from afferents.core.recording import Recording, Session
from afferents.recordings.audio import WavFile
from afferents.recordings.session_file import SESSION_FILE, SessionFile
from afferents.recordings.video import VideoFile

SHORTER_AUDIO_S = 0.5
"""How much shorter than the video the audio may be, s."""
LONGER_AUDIO_S, LONGER_AUDIO = 1.0, 0.05
"""How much longer, s and as a share of the video: recorders are started and stopped one after the
other, by hand or by a script. Half a video is found from 2.2 s of sound on."""

RATE_TOLERANCE = 0.1
"""How far a video's nominal frame rate may lie from the declared one, as a share of it."""


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

"""Whether the files of a session folder are what its `session.json` declares, and each its own."""

import hashlib
import json
from collections.abc import Collection
from pathlib import Path

from afferents.core.doubt import Doubt, Kind, accepted
from afferents.core.errors import InputError
from afferents.core.files import checksum, size_of
from afferents.core.recording import EDGE_S, Recording, Session
from afferents.recordings.audio import WavFile
from afferents.recordings.frame_rate import rate_doubted, wrong_rate
from afferents.recordings.images import ImageFolder
from afferents.recordings.session_file import SessionFile
from afferents.recordings.video import VideoFile

ClipFile = VideoFile | ImageFolder
"""What a camera leaves on disk."""

SHORTER_AUDIO_S, SHORTER_AUDIO = 0.5, 0.02
"""How much shorter than the video the audio may be, s or as a share of it, whatever is cut off."""
LONGER_AUDIO_S, LONGER_AUDIO = 1.0, 0.05
"""How much longer, s and as a share of the video: recorders are started and stopped one after the
other, by hand or by a script. Half a video is found from 2.2 s of sound on."""

SHORT = 4
"""Of a short recording, at most one part in so many is cut off at an end."""
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
        return size_of(path)
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
                f"the file whose checksum {declared.file} declares",
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
        audio of another rate or with other channels, or (unless `length` is accepted) so much
        shorter than the video that the part at constant speed lacks some, or more than 1 s and 5%
        longer.
    """
    video, audio = recording.video, recording.audio
    sound = audio if isinstance(audio, WavFile) else None
    if isinstance(video, ClipFile):
        _check_video(video, sound, declared)
    if sound is not None:
        _check_audio(sound, declared)
    if isinstance(video, ClipFile) and sound is not None:
        return accepted(_doubt_lengths(video, sound, recording.steady_s, declared), accept)
    return []


def _check_video(video: ClipFile, audio: WavFile | None, declared: SessionFile) -> None:
    found = (video.width, video.height)
    width, height = declared.frame_width or found[0], declared.frame_height or found[1]
    if found != (width, height):
        raise InputError(
            video.path,
            f"frames of {width}x{height} px",
            f"{found[0]}x{found[1]}",
            f"declare frame_width and frame_height in {declared.file}",
        )
    expected_hz = declared.fps_hz
    if expected_hz is None or (isinstance(video, VideoFile) and video.rate_hz is not None):
        return
    if abs(video.fps_hz - expected_hz) > RATE_TOLERANCE * expected_hz:
        raise InputError(
            video.path,
            f"about {expected_hz:g} frames a second",
            f"{video.fps_hz:g}",
            wrong_rate(video.n_frames, video.fps_hz, expected_hz, audio, declared.file),
        )


def _check_audio(audio: WavFile, declared: SessionFile) -> None:
    rate, channels = audio.sample_rate_hz, audio.n_channels
    expected = (declared.sample_rate_hz or rate, declared.audio_channels or channels)
    if (rate, channels) != expected:
        raise InputError(
            audio.path,
            f"{expected[1]} channel(s) at {expected[0]:g} Hz",
            f"{channels} at {rate:g} Hz",
            f"declare audio_channels and sample_rate_hz in {declared.file}",
        )


def _doubt_lengths(
    video: ClipFile,
    audio: WavFile,
    steady_s: tuple[float, float] | None,
    declared: SessionFile,
) -> list[Doubt]:
    """Compare the lengths; audio need not go on after the part that is used has ended."""
    video_s, audio_s = video.duration_s, audio.n_samples / audio.sample_rate_hz
    used_s = steady_s[1] if steady_s else video_s - min(EDGE_S, video_s / SHORT)
    least_s = min(video_s - max(SHORTER_AUDIO_S, SHORTER_AUDIO * video_s), used_s)
    most_s = video_s * (1 + LONGER_AUDIO) + LONGER_AUDIO_S
    if least_s <= audio_s and (audio_s <= most_s or video_s == 0):  # 0: none is declared
        return []
    bound = f"at least {least_s:.2f}" if audio_s < least_s else f"at most {most_s:.2f}"
    expected = f"audio of {bound} s, for a video of {video_s:.2f} s"
    cause = rate_doubted(video.n_frames, video.fps_hz, audio, declared.file)
    return [Doubt("length", audio.path, expected, f"{audio_s:.2f} s", cause)]

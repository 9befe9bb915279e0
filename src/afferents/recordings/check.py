"""What the headers of a recording's files state, and whether its session declares the same.

A container's frame rate may be wrong: writers such as OpenCV's note what a script says, often 30 or
25 frames a second, whatever the camera did. The video's sound keeps a true clock.
"""

import hashlib
import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from afferents.errors import InputError, reading, then
from afferents.files import checksum, size_of
from afferents.quality.issues import Kind, QualityIssue, require_accepted
from afferents.quality.lasting import EDGE_S
from afferents.recordings.audio import WavFile
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.session_file import FPS, SessionFile
from afferents.recordings.video import VideoFile
from afferents.store.recording import Recording, RecordingSet
from afferents.store.trimming import require_reached

ClipFile = VideoFile | ImageFolder
"""What a camera leaves on disk."""

_OF_VIDEO = ("width", "height", "fps_hz", "n_frames", "duration_s")
_OF_SOUND = ("n_channels", "sample_rate_hz", "n_samples")

SHORTER_AUDIO_S, SHORTER_AUDIO = 0.5, 0.02
"""How much shorter than the video the audio may be, s or as a share of it, whatever is cut off."""
LONGER_AUDIO_S, LONGER_AUDIO = 1.0, 0.05
"""How much longer, s and as a share of the video: recorders are started and stopped one after the
other, by hand or by a script. Half a video is found from 2.2 s of sound on."""

SHORT = 4
"""Of a short recording, at most one part in this many is cut off at an end."""

RATE_TOLERANCE = 0.1
"""How far a video's nominal frame rate may lie from the declared one, as a share of it."""
NEAR = 0.05
"""Video and sound are of one length within this share of it: they don't begin and end together."""


def require_own_files(session: RecordingSet) -> None:
    """Refuse recordings that share a file: one recorded once and copied, or laid in twice.

    Only files of one size are read, so that a session of any size is looked at but once.

    Raises
    ------
    InputError
        Naming two files of the same bytes.
    """
    by_size: dict[int, list[Path]] = {}
    for path in (path for recording in session.recordings for path in recording.files):
        with reading(path, "a readable file", OSError):
            by_size.setdefault(size_of(path), []).append(path)
    seen: dict[str, Path] = {}
    for size, paths in by_size.items():
        for path in paths if size and len(paths) > 1 else ():  # empty ones are no recordings
            with reading(path, "a readable file", OSError):
                other = seen.setdefault(checksum(path), path)
            if other != path:  # a file that is listed twice may hold two recordings
                raise InputError(
                    f"{path}: expected a recording of its own, found the same bytes as {other}; "
                    "remove the copy, or record what is missing"
                )


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
    found: dict[str, str] = {}
    files = [path.name for path in recording.files]
    if expected and not any(name in expected for name in files):
        raise InputError(
            f"{declared.file}: expected checksums of {recording.name}'s {' and '.join(files)}, "
            f"found {', '.join(expected)} alone; name files without their folders"
        )
    for path in recording.files:
        with reading(path, "a readable file", OSError):
            found[path.name] = checksum(path)
        if expected.get(path.name, found[path.name]).lower() != found[path.name]:
            raise InputError(
                f"{path}: expected the file whose checksum {declared.file} declares, found "
                "another; bring it back, or take its checksum out if it was changed on purpose"
            )
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()


def check_recording(
    recording: Recording, declared: SessionFile, accept: Collection[Kind] = ()
) -> list[QualityIssue]:
    """Check one recording of a session folder by its headers.

    Returns
    -------
    What is wrong with it and accepted.

    Raises
    ------
    InputError
        If a file is unreadable, the video of another size or frame rate than declared, or over
        before the declared constant speed is, the audio of another rate or with other channels, or
        (unless `length` is accepted) so much shorter than the video that the part at constant
        speed lacks some, or more than 1 s and 5% longer.
    """
    video, audio = recording.video, recording.audio
    sound = audio if isinstance(audio, WavFile) else None
    if isinstance(video, ClipFile):
        _check_video(video, sound, declared)
        _require_steady(recording, video.path, video.duration_s, declared)
    if sound is not None:
        rate, channels = sound.sample_rate_hz, sound.n_channels
        expected = (declared.sample_rate_hz or rate, declared.audio_channels or channels)
        if (rate, channels) != expected:
            raise InputError(
                f"{sound.path}: expected {expected[1]} channel(s) at {expected[0]:g} Hz, found "
                f"{channels} at {rate:g} Hz; declare audio_channels and sample_rate_hz in "
                f"{declared.file}"
            )
    if sound is not None and video is None:
        _require_steady(recording, sound.path, sound.n_samples / sound.sample_rate_hz, declared)
    if isinstance(video, ClipFile) and sound is not None:
        return require_accepted(_doubt_lengths(video, sound, recording.steady_s, declared), accept)
    return []


def _check_video(video: ClipFile, audio: WavFile | None, declared: SessionFile) -> None:
    found = (video.width, video.height)
    width, height = declared.frame_width or found[0], declared.frame_height or found[1]
    if found != (width, height):
        raise InputError(
            f"{video.path}: expected frames of {width}x{height} px, found {found[0]}x{found[1]}; "
            f"declare frame_width and frame_height in {declared.file}"
        )
    expected_hz = declared.fps_hz
    if expected_hz is None or video.rate_hz is not None:
        return
    off_hz = abs(video.fps_hz - expected_hz)
    if off_hz > RATE_TOLERANCE * expected_hz and not lost_frames(video, expected_hz):
        do = wrong_rate(video.n_frames, video.fps_hz, expected_hz, audio, declared.file)
        raise InputError(
            f"{video.path}: expected about {expected_hz:g} frames a second, found "
            f"{video.fps_hz:g}{then(do)}"
        )


def _require_steady(
    recording: Recording, path: Path, length_s: float, declared: SessionFile
) -> None:
    """Refuse a constant speed that goes on after the recording has ended; 0 s: none is declared."""
    if recording.steady_s and length_s > 0:
        require_reached(path, length_s, recording.steady_s, f"mend steady_s in {declared.file}")


def _doubt_lengths(
    video: ClipFile,
    audio: WavFile,
    steady_s: tuple[float, float] | None,
    declared: SessionFile,
) -> list[QualityIssue]:
    """Compare the lengths; audio need not go on after the part that is used has ended."""
    video_s, audio_s = video.duration_s, audio.n_samples / audio.sample_rate_hz
    used_s = steady_s[1] if steady_s else video_s - min(EDGE_S, video_s / SHORT)
    least_s = min(video_s - max(SHORTER_AUDIO_S, SHORTER_AUDIO * video_s), used_s)
    most_s = video_s * (1 + LONGER_AUDIO) + LONGER_AUDIO_S
    if least_s <= audio_s and (audio_s <= most_s or video_s == 0):  # 0: none is declared
        return []
    bound = f"at least {least_s:.2f}" if audio_s < least_s else f"at most {most_s:.2f}"
    expected = f"audio of {bound} s, for a video of {video_s:.2f} s"
    cause = f"if the video's {video.fps_hz:g} frames a second are wrong, give the true {FPS}"
    return [QualityIssue("length", audio.path, expected, f"{audio_s:.2f} s", cause)]


def facts(recording: Recording) -> dict[str, Any]:
    """Describe a recording by its headers; no frame or sample is decoded.

    Returns
    -------
    dict
        `name`, `texture`, `speed_mm_s`, `video` (see `video_facts`) and `vibration` (channels in
        the file, Hz, samples in each, s), None where it has none.

    Raises
    ------
    InputError
        If one of its files is unreadable.
    """
    video, audio = recording.video, recording.audio
    vibration = None
    if audio is not None:
        vibration = {name: getattr(audio, name) for name in _OF_SOUND}
        vibration["duration_s"] = audio.n_samples / audio.sample_rate_hz
    return {
        "name": recording.name,
        "texture": recording.texture,
        "speed_mm_s": recording.speed_mm_s,
        "video": video_facts(video) if isinstance(video, ClipFile) else None,
        "vibration": vibration,
    }


def video_facts(video: ClipFile) -> dict[str, Any]:
    """Return what a video's container declares: size (px), rate (Hz), frames, duration (s)."""
    return {name: getattr(video, name) for name in _OF_VIDEO}


def lost_frames(video: object, expected_hz: float) -> bool:
    """Return whether a video's low rate is that of lost frames, which its times show as gaps.

    To give the expected rate would squeeze its time.
    """
    return isinstance(video, VideoFile) and (
        abs(video.usual_hz - expected_hz) <= RATE_TOLERANCE * expected_hz
    )


def wrong_rate(
    n_frames: int, fps_hz: float, expected_hz: float, audio: WavFile | None, file: str
) -> str:
    """Return what to do about a video whose frame rate is not the declared one.

    Parameters
    ----------
    n_frames
        Of the video.
    fps_hz, expected_hz
        Its rate, and the one that is declared or usual.
    audio
        Its sound, if there is any.
    file
        The session file.
    """
    true = f"give {FPS} {expected_hz:g}, or write fps_hz and fps_overrules (true) into {file}"
    seen_hz = n_frames * audio.sample_rate_hz / audio.n_samples if audio else float("nan")
    if abs(seen_hz - expected_hz) <= NEAR * expected_hz:
        return (
            f"its {n_frames} frames are as long as its sound at {expected_hz:g} a second, so the "
            f"container's rate is wrong: {true}"
        )
    declare = f"declare fps_hz in {file}"
    if abs(seen_hz - fps_hz) <= NEAR * fps_hz:
        return f"{declare}: its {n_frames} frames are as long as its sound at {fps_hz:g} a second"
    return f"{declare}; if the container's rate is wrong, {true}"

"""What a recording's headers say of it, for `inspect`."""

from dataclasses import dataclass

from afferents.core.recording import Recording, Vibration
from afferents.recordings.check import ClipFile


@dataclass(frozen=True)
class VideoFacts:
    """Size (px), nominal rate (Hz), declared number of frames and duration (s) of a video."""

    width: int
    height: int
    fps_hz: float
    n_frames: int
    duration_s: float


@dataclass(frozen=True)
class VibrationFacts:
    """Channels in the file, rate (Hz), samples in each channel and duration (s)."""

    n_channels: int
    sample_rate_hz: float
    n_samples: int
    duration_s: float


@dataclass(frozen=True)
class Facts:
    """What there is of a recording; None where it has no video or no vibration channels."""

    name: str
    texture: str
    speed_mm_s: float | None
    video: VideoFacts | None
    vibration: VibrationFacts | None


def facts(recording: Recording) -> Facts:
    """Describe a recording by its headers; no frame or sample is decoded.

    Raises
    ------
    InputError
        If one of its files is unreadable.
    """
    return Facts(
        recording.name,
        recording.texture,
        recording.speed_mm_s,
        video_facts(recording.video) if isinstance(recording.video, ClipFile) else None,
        _vibration_facts(recording.audio) if recording.audio is not None else None,
    )


def video_facts(video: ClipFile) -> VideoFacts:
    """Return what a video's container declares."""
    return VideoFacts(video.width, video.height, video.fps_hz, video.n_frames, video.duration_s)


def _vibration_facts(audio: Vibration) -> VibrationFacts:
    duration_s = audio.n_samples / audio.sample_rate_hz
    return VibrationFacts(audio.n_channels, audio.sample_rate_hz, audio.n_samples, duration_s)

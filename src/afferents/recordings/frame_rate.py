"""Whether a video's frame rate is wrong, as its number of frames and its sound tell.

Writers such as OpenCV's note what a script says, often 30 or 25 frames a second, whatever the
camera did. The video's sound keeps a true clock.
"""

from afferents.recordings.audio import WavFile
from afferents.recordings.session_file import FPS
from afferents.recordings.video import VideoFile

RATE_TOLERANCE = 0.1
"""How far a video's nominal frame rate may lie from the declared one, as a share of it."""
NEAR = 0.05
"""Video and sound are of one length within this share of it: they don't begin and end together."""


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
    if _near(seen_hz, expected_hz):
        return (
            f"its {n_frames} frames are as long as its sound at {expected_hz:g} a second, so the "
            f"container's rate is wrong: {true}"
        )
    declare = f"declare fps_hz in {file}"
    if _near(seen_hz, fps_hz):
        return f"{declare}: its {n_frames} frames are as long as its sound at {fps_hz:g} a second"
    return f"{declare}; if the container's rate is wrong, {true}"


def _near(one_hz: float, other_hz: float) -> bool:
    return abs(one_hz - other_hz) <= NEAR * other_hz

"""Whether a video's frame rate is wrong, as its number of frames and its sound tell.

Writers such as OpenCV's note what a script says, often 30 or 25 frames a second, whatever the
camera did. The sound beside the video keeps a true clock.
"""

from afferents.recordings.audio import WavFile
from afferents.recordings.session_file import FPS

USUAL_HZ = (24, 25, 30, 50, 60, 90, 100, 120, 150, 180, 200, 240)
"""Frame rates of cameras."""
NEAR = 0.05
"""Video and sound are of one length within this share of it: they don't begin and end together."""


def wrong_rate(
    n_frames: int, fps_hz: float, expected_hz: float, audio: WavFile | None, file: str
) -> str:
    """Say what to do about a video whose frame rate is not the declared one.

    Parameters
    ----------
    n_frames
        Of the video.
    fps_hz, expected_hz
        Its rate, and the one that is declared or usual.
    audio
        The sound beside it, if there is any.
    file
        The session file.
    """
    true = _say(expected_hz, file)
    seen_hz = _by_sound(n_frames, audio)
    if seen_hz is not None and _near(seen_hz, expected_hz):
        return (
            f"its {n_frames} frames are as long as its sound at {expected_hz:g} a second, so the "
            f"container's rate is wrong: {true}"
        )
    declare = f"declare fps_hz in {file}"
    if seen_hz is not None and _near(seen_hz, fps_hz):
        return f"{declare}: its {n_frames} frames are as long as its sound at {fps_hz:g} a second"
    return f"{declare}; if the container's rate is wrong, {true}"


def rate_doubted(n_frames: int, fps_hz: float, audio: WavFile, file: str) -> str:
    """Say at which usual rate a video would be as long as its sound; nothing where there is none.

    Parameters
    ----------
    n_frames, fps_hz
        Of the video, and the rate that its times now count from.
    audio
        The sound beside it, of another length.
    file
        The session file.
    """
    seen_hz = _by_sound(n_frames, audio)
    usual = [hz for hz in USUAL_HZ if seen_hz is not None and _near(seen_hz, hz)]
    if not usual or _near(usual[0], fps_hz) or seen_hz is None:
        return ""
    true_hz = min(usual, key=lambda hz: abs(hz - seen_hz))
    return (
        f"its {n_frames} frames would be as long as the sound at {true_hz:g} a second: if the "
        f"frame rate of {fps_hz:g} is wrong, {_say(true_hz, file)}"
    )


def _by_sound(n_frames: int, audio: WavFile | None) -> float | None:
    """Return the frame rate at which a video is as long as its sound, Hz."""
    return None if audio is None else n_frames * audio.sample_rate_hz / audio.n_samples


def _near(one_hz: float, other_hz: float) -> bool:
    return abs(one_hz - other_hz) <= NEAR * other_hz


def _say(fps_hz: float, file: str) -> str:
    return f"give {FPS} {fps_hz:g}, or write fps_hz and fps_overrules (true) into {file}"

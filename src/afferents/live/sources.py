"""Sources by the names that the command line gives them."""

from collections.abc import Sequence
from pathlib import Path

from afferents.core.errors import InputError
from afferents.live.camera import Camera
from afferents.live.events import Source, let_go
from afferents.live.microphone import Microphone
from afferents.live.perceiver import Perceiver
from afferents.live.replay import Pace, ReplayedSound, ReplayedVideo, recorded
from afferents.live.rig import RigShow, RigSound, RigVideo
from afferents.pipeline.sensor_rig import rig_of
from afferents.recordings import WavFile, open_video
from afferents.recordings.session import AUDIO, VIDEO
from afferents.rig import Rig

VIDEO_SOURCES = "camera:0, replay:SESSION/3/50 or rig"
AUDIO_SOURCES = "mic:default, replay:SESSION/3/50 or rig"


def open_sources(
    video: str | None,
    audio: str | None,
    perceiver: Perceiver,
    speed: float = 1.0,
    exposure_ms: float | None = None,
) -> Sequence[Source]:
    """Open what the models feel by.

    Parameters
    ----------
    video
        ``camera:NUMBER``, ``replay:RECORDING`` or ``rig`` (``rig:TEXTURE/SPEED`` for one drum).
    audio
        ``mic:NAME``, ``replay:RECORDING`` or ``rig``.
    perceiver
        Says which of them are needed, and at which rates.
    speed
        Of replays; infinite for as fast as possible.
    exposure_ms
        Of the camera; None leaves it.

    Raises
    ------
    InputError
        If a name is none of these, or what it names is not there.
    """
    opened: list[Source] = []
    try:
        _open(opened, video, audio, perceiver, Pace(speed), exposure_ms)
    except BaseException:
        with let_go(opened):
            raise
    return opened


def _open(
    opened: list[Source],
    video: str | None,
    audio: str | None,
    perceiver: Perceiver,
    pace: Pace,
    exposure_ms: float | None,
) -> None:
    shows: dict[str, RigShow] = {}
    if perceiver.video is not None and video is not None:
        kind, _, name = video.partition(":")
        sensor = perceiver.video.sensor
        if kind == "camera":
            size = (sensor.width or 640, sensor.height or 480)
            opened.append(Camera(name or "0", perceiver.video.rate_hz, *size, exposure_ms))
        elif kind == "replay":
            file = open_video(recorded(Path(name), VIDEO))
            opened.append(ReplayedVideo(file, pace))
        elif kind == "rig":
            opened.append(RigVideo(shows.setdefault(name, _show(name, rig_of(sensor)))))
        else:
            raise InputError("--video", VIDEO_SOURCES, f"'{video}'")
    if perceiver.audio is not None and audio is not None:
        kind, _, name = audio.partition(":")
        if kind == "mic":
            n_channels = perceiver.audio.sessions[0].card.shape[0]
            opened.append(Microphone(name or "default", perceiver.audio.rate_hz, n_channels))
        elif kind == "replay":
            opened.append(ReplayedSound(WavFile(recorded(Path(name), AUDIO)), pace))
        elif kind == "rig":
            opened.append(RigSound(shows[name] if name in shows else _show(name)))
        else:
            raise InputError("--audio", AUDIO_SOURCES, f"'{audio}'")


def _show(name: str, rig: Rig | None = None) -> RigShow:
    """Read ``TEXTURE/SPEED``, ``TEXTURE`` or nothing; the rig is that of the models' sensor."""
    texture, _, speed = name.partition("/")
    try:
        speed_mm_s = float(speed) if speed else None
    except ValueError:
        raise InputError("rig", "rig:TEXTURE/SPEED, such as rig:g/50", f"'rig:{name}'") from None
    if speed_mm_s is not None and not 0 < speed_mm_s <= 500:
        raise InputError("rig", "a speed above 0 and up to 500 mm/s", speed)
    return RigShow(texture or None, speed_mm_s, rig=rig)

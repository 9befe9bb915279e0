"""Sources by the names that the command line gives them."""

from collections.abc import Sequence
from pathlib import Path

from afferents.errors import InputError
from afferents.lab.live import events, follower, replay, rig_show, sensors
from afferents.markers import calibrate, track
from afferents.markers.sensor import Sensor, load_sensor
from afferents.recordings.audio import WavFile
from afferents.recordings.layouts import AUDIO, VIDEO, find_video, make_clip, session_around
from afferents.recordings.media import is_image_folder
from afferents.rig import config, sensor_rig
from afferents.store.recording import Video

VIDEO_SOURCES = "camera:0, replay:SESSION/3/50, a video file, rig or rig:g/50"
AUDIO_SOURCES = "mic:default, replay:SESSION/3/50, a sound file, rig or rig:g/50"
_GONE = ", and there is no such file"
KINDS = ("camera", "mic", "replay", "rig")
RIG_SENSOR = "tip_b"
"""The rig's own fingertip."""


def open_sources(
    video: str | None,
    audio: str | None,
    wanted: events.Wanted,
    speed: float = 1.0,
    exposure_ms: float | None = None,
    fps_hz: float | None = None,
) -> Sequence[events.Source]:
    """Open what models classify by, or what is shown without them.

    Parameters
    ----------
    video
        ``camera:NUMBER``, ``replay:RECORDING`` or ``rig`` (``rig:TEXTURE/SPEED`` for one drum); a
        path alone is replayed.
    audio
        ``mic:NAME``, ``replay:RECORDING`` or ``rig``.
    wanted
        Which of them are needed, and at which rates.
    speed
        Of replays; infinite for as fast as possible.
    exposure_ms
        Of the camera; None leaves it.
    fps_hz
        True frame rate of a recording; None for what its session or file says.

    Raises
    ------
    InputError
        If a name is none of these, or what it names is not there.
    """
    opened: list[events.Source] = []
    pace, shows = replay.Pace(speed), dict[str, rig_show.RigShow]()
    try:
        if "video" in wanted.channels and video is not None:
            kind, name = _split(video)
            if kind == "camera":
                sensor = wanted.sensor
                size: tuple[int | None, int | None] = (None, None)
                if sensor is not None:  # at the size of pictures that its file holds for
                    size = (sensor.width or 640, sensor.height or 480)
                opened.append(sensors.Camera(name or "0", wanted.fps_hz, *size, exposure_ms))
            elif kind == "replay":
                opened.append(replay.ReplayedVideo(_open_clip(name, fps_hz), pace))
            elif kind == "rig":
                rig = None if wanted.sensor is None else sensor_rig.make_rig(wanted.sensor)
                opened.append(rig_show.RigVideo(shows.setdefault(name, _make_show(name, rig))))
            else:
                raise InputError(f"--video: expected {VIDEO_SOURCES}, found '{video}'{_GONE}")
        if "audio" in wanted.channels and audio is not None:
            kind, name = _split(audio)
            if kind == "mic":
                rate_hz, n_channels = wanted.sample_rate_hz, wanted.n_channels
                opened.append(sensors.Microphone(name or "default", rate_hz, n_channels))
            elif kind == "replay":
                path = replay.require_recording(Path(name), AUDIO)
                channel = session_around(path)[0].channel  # that its session names; else the last
                opened.append(replay.ReplayedSound(WavFile(path, channel), pace))
            elif kind == "rig":
                opened.append(rig_show.RigSound(shows[name] if name in shows else _make_show(name)))
            else:
                raise InputError(f"--audio: expected {AUDIO_SOURCES}, found '{audio}'{_GONE}")
    except BaseException:
        with events.close_afterwards(opened):
            raise
    return opened


def find_sensor(
    video: str | None, sensor: Sensor | None = None, fps_hz: float | None = None
) -> Sensor | None:
    """Return the sensor that a source shows: as given, the rig's, or as a clip shows its markers.

    A recording is looked at first, so that a sensor of another kind is refused before anything
    opens.

    Parameters
    ----------
    video, fps_hz
        As for `open_sources`.
    sensor
        As the user describes it; None to find its markers at rest, as `calibrate` does.

    Returns
    -------
    Sensor | None
        None where frames must come first, as of a camera.

    Raises
    ------
    InputError
        If the recording shows no markers, or not the sensor's.
    """
    kind, name = _split(video) if video is not None else ("", "")
    if kind == "rig":
        return sensor or load_sensor(RIG_SENSOR)
    if kind != "replay":
        return sensor
    clip = _open_clip(name, fps_hz)
    sensor = sensor or calibrate.calibrate_from_clips(clip, follower.FOUND).sensor
    track.ordered_rest(clip, sensor)
    return sensor


def _split(source: str) -> tuple[str, str]:
    """Return the kind of a source and its name; a path alone is one to replay."""
    kind, _, name = source.partition(":")
    if kind not in KINDS and source and Path(source).exists():
        return "replay", source
    return kind, name


def _open_clip(name: str, fps_hz: float | None) -> Video:
    """Return a file's pictures, or those of a recording's folder, at the rate its session says."""
    path = Path(name)
    if not is_image_folder(path):
        found = find_video(path) if path.is_dir() else None
        path = found or replay.require_recording(path, VIDEO)
    declared, own_hz = session_around(path)
    return make_clip(path, declared, fps_hz or own_hz)


def _make_show(name: str, rig: config.Rig | None = None) -> rig_show.RigShow:
    """Read ``TEXTURE/SPEED``, ``TEXTURE`` or nothing; the rig is that of the models' sensor."""
    texture, _, speed = name.partition("/")
    try:
        speed_mm_s = float(speed) if speed else None
    except ValueError:
        raise InputError(
            f"rig: expected rig:TEXTURE/SPEED, such as rig:g/50, found 'rig:{name}'"
        ) from None
    if speed_mm_s is not None and not 0 < speed_mm_s <= 500:
        raise InputError(f"rig: expected a speed above 0 and up to 500 mm/s, found {speed}")
    return rig_show.RigShow(texture or None, speed_mm_s, rig=rig)

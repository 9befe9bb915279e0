"""Bags of ROS 1 and ROS 2 as files that can be imported: a video, its times, and sound.

A bag is a folder of rosbag2 (sqlite3 or MCAP), an MCAP file, or a ``.bag`` of ROS 1. Pictures are
`sensor_msgs` Image or CompressedImage; sound is `audio_common_msgs` AudioData or AudioDataStamped,
or Foxglove's RawAudio. Times are those of the messages' headers, else those of the bag.
"""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import soundfile
from numpy.typing import NDArray

from afferents.errors import InputError, reading
from afferents.lab.devices.base import CameraSettings
from afferents.lab.writers import VideoWriter
from afferents.recordings import ros_messages as ros

_PICTURES = (ros.PICTURE, ros.RAW_PICTURE)
_SOUNDS = (ros.SOUND, ros.ROS_SOUND, ros.ROS_SOUND_STAMPED)
_GREY = ("mono8", "8UC1")
_USUAL_HZ = 44_100
_CODINGS, _SAMPLES = ("", "wave", "pcm"), ("", "S16LE")
"""What an AudioInfo states of sound that is neither compressed nor of other samples."""
_LOST_S, _LOST_UNSTAMPED_S = 0.02, 0.1
"""Sound may lag this far behind the times of its messages, s: the bag's own vary more."""
_DRIFT = 5e-4
"""A sound card's clock may be off by this share."""
JPEG = b"\xff\xd8"


class ImportedFiles(NamedTuple):
    """What is imported: a video, its sound, and times of its frames.

    Attributes
    ----------
    video, audio
        Files; without sound `audio` is None.
    time_s
        When each frame was taken, (n_frames,), s.
    audio_start_s
        When the first sample was taken, on the same clock.
    where, origin
        What a user named, for an error and for `run.json`.
    sequence
        The camera's numbers of the frames, (n_frames,); None where it has none.
    """

    video: Path
    audio: Path | None
    time_s: NDArray[np.float64]
    audio_start_s: float
    where: Path
    origin: dict[str, str]
    sequence: NDArray[np.int64] | None = None


def extract_files(
    path: Path,
    folder: Path,
    image: str | None = None,
    audio: str | None = None,
    audio_rate_hz: int | None = None,
    audio_channels: int | None = None,
) -> ImportedFiles:
    """Write pictures and sound of a bag into a folder.

    Parameters
    ----------
    image, audio
        Topics; None for the only one of its kind (sound may be lacking).
    audio_rate_hz, audio_channels
        Of sound whose messages do not state it; None for what an AudioInfo states, else 44100
        and 1.

    Raises
    ------
    InputError
        If the bag can't be read, lacks the topics, or holds what is no picture or sound, or not
        the whole of it.
    """
    store = ros.typestore()
    from rosbags.highlevel import AnyReader

    what = "a bag of ROS (a rosbag2 folder, an .mcap or a .bag) that can be read to its end"
    with reading(path, what), AnyReader([path], default_typestore=store) as reader:
        pictures = _choose_topic(reader, path, _PICTURES, image, "--image-topic", "pictures")
        sounds = _choose_topic(reader, path, _SOUNDS, audio, "--audio-topic", "sound")
        if pictures is None:
            there = ", ".join(sorted(reader.topics)) or "no topic"
            raise InputError(f"{path}: expected a topic of pictures, found {there}")
        video, heard = folder / "video.mp4", folder / "audio.wav"
        time_s = np.array(_write_video(reader, pictures, path, video))
        origin = {"bag": str(path)}
        if sounds is None:
            return ImportedFiles(video, None, time_s, float(time_s[0]), path, origin)
        rate_hz, channels = _read_sound_info(reader, path)
        stated = audio_rate_hz or rate_hz, audio_channels or channels
        start_s = _write_sound(reader, sounds, path, heard, *stated)
        return ImportedFiles(video, heard, time_s, start_s, path, origin)


def _choose_topic(
    reader: Any, path: Path, types: Sequence[str], named: str | None, option: str, what: str
) -> Any:
    """Return the connection of a topic: the one that is named, or the only one of its types."""
    fitting = {one.topic: one for one in reader.connections if one.msgtype in types}
    if named is not None:
        if named not in fitting:
            there = ", ".join(sorted(fitting)) or "none"
            raise InputError(
                f"{option}: expected a topic of {what} in {path} ({there}), found '{named}'"
            )
        return fitting[named]
    if len(fitting) > 1:
        expected = f"one topic of {what}, or {option}"
        raise InputError(
            f"{path}: expected {expected}, found {len(fitting)} ({', '.join(sorted(fitting))})"
        )
    return next(iter(fitting.values()), None)


def _read_messages(reader: Any, connection: Any) -> Iterator[tuple[float, Any]]:
    """Yield a topic's messages and when each was made, s: by its header, if set, else the bag."""
    for _, at_ns, data in reader.messages(connections=[connection]):
        message = reader.deserialize(data, connection.msgtype)
        stamp = getattr(message, "timestamp", None) or getattr(
            getattr(message, "header", None), "stamp", None
        )
        made_ns = 0 if stamp is None else stamp.sec * ros.NS + stamp.nanosec
        yield (made_ns or at_ns) / ros.NS, message


def _write_video(reader: Any, connection: Any, path: Path, target: Path) -> list[float]:
    """Write pictures: JPEGs as they came, raw ones without loss. Return their times, s."""
    times_s: list[float] = []
    with ExitStack() as files:
        for at_s, message in _read_messages(reader, connection):
            format_, size, data = _read_picture(message, path)
            if not times_s:
                first, settings = (format_, size), CameraSettings(str(path), format_, *size, 90.0)
                video = files.enter_context(closing(VideoWriter(target, settings)))
            elif (format_, size) != first:
                expected = f"pictures of {first[1][0]} x {first[1][1]} px as the first"
                raise InputError(f"{path}: expected {expected}, found one of {size[0]} x {size[1]}")
            elif at_s <= times_s[-1]:
                expected = f"times that rise in {connection.topic}"
                raise InputError(
                    f"{path}: expected {expected}, found {at_s:.6f} s after {times_s[-1]:.6f}"
                )
            times_s.append(at_s)
            video.write(data, at_s - times_s[0])
    if len(times_s) < 2:
        raise InputError(
            f"{path}: expected 2 pictures or more in {connection.topic}, found {len(times_s)}"
        )
    return times_s


def _read_picture(message: Any, path: Path) -> tuple[str, tuple[int, int], bytes]:
    """Return a picture's format, its width and height, and its content as `VideoWriter` has it."""
    data = np.asarray(message.data, np.uint8)
    if hasattr(message, "format"):
        content = data.tobytes()
        picture = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if len(data) else None
        if picture is None or not content.startswith(JPEG):
            found = f"'{message.format}'"
            raise InputError(f"{path}: expected compressed pictures that are JPEGs, found {found}")
        return "MJPG", (picture.shape[1], picture.shape[0]), content
    width, height = int(message.width), int(message.height)
    rows = data[: height * message.step].reshape(height, message.step)
    if message.encoding in _GREY:
        return "GREY", (width, height), rows[:, :width].tobytes()
    codes = {"bgr8": cv2.COLOR_BGR2GRAY, "rgb8": cv2.COLOR_RGB2GRAY}
    if message.encoding not in codes:
        known, found = ", ".join((*_GREY, *codes)), f"'{message.encoding}'"
        raise InputError(f"{path}: expected pictures encoded as {known}, found {found}")
    colours = rows[:, : 3 * width].reshape(height, width, 3)
    grey = np.asarray(cv2.cvtColor(colours, codes[message.encoding]), np.uint8)
    return "GREY", (width, height), grey.tobytes()


def _write_sound(
    reader: Any, connection: Any, path: Path, target: Path, rate_hz: int, channels: int
) -> float:
    """Write sound as 16-bit wav; return when its first sample was taken, s.

    Parameters
    ----------
    rate_hz, channels
        Of sound whose messages do not state it.
    """
    blocks, came_s, heard_s = [], [], [0.0]
    for at_s, message in _read_messages(reader, connection):
        if connection.msgtype == ros.SOUND:
            if message.format != ros.PCM:
                raise InputError(
                    f"{path}: expected sound of format '{ros.PCM}', found '{message.format}'"
                )
            rate_hz, channels = int(message.sample_rate), int(message.number_of_channels)
        content = getattr(message, "audio", message).data
        values = np.asarray(content, np.uint8)
        if len(values) % (2 * channels):
            expected = f"16-bit samples of {channels} channel(s)"
            raise InputError(
                f"{path}: expected {expected}, found {len(values)} bytes in {connection.topic}"
            )
        blocks.append(values.view("<i2").reshape(-1, channels))
        came_s.append(at_s)
        heard_s.append(heard_s[-1] + len(blocks[-1]) / rate_hz)
    if not blocks:
        raise InputError(f"{path}: expected sound in {connection.topic}, found no message")
    _require_whole(np.array(came_s) - came_s[0], np.array(heard_s[:-1]), connection, path)
    soundfile.write(target, np.concatenate(blocks), rate_hz, "PCM_16", format="WAV")
    return came_s[0]


def _require_whole(
    came_s: NDArray[np.float64], heard_s: NDArray[np.float64], connection: Any, path: Path
) -> None:
    """Refuse sound of which some was lost: all that follows would lie too early.

    Parameters
    ----------
    came_s, heard_s
        When each message came, since the first, and how much sound was in those before it, s.
    """
    # One message may come late, and the next ones catch up; what was lost is never caught up.
    lost_s = np.minimum.accumulate((came_s - heard_s)[::-1])[::-1]
    lost_s -= lost_s[0]
    allowed_s = _LOST_UNSTAMPED_S if connection.msgtype == ros.ROS_SOUND else _LOST_S
    if (over := lost_s > allowed_s + _DRIFT * came_s).any():
        n = int(np.argmax(over))
        raise InputError(
            f"{path}: expected whole sound in {connection.topic}, found {lost_s[n]:.2f} s missing "
            f"before {came_s[n]:.2f} s; record it again"
        )


def _read_sound_info(reader: Any, path: Path) -> tuple[int, int]:
    """Return rate, Hz, and channels of sound, as an AudioInfo states; else the usual."""
    rate_hz, channels = _USUAL_HZ, 1
    for connection in reader.connections:
        if connection.msgtype == ros.ROS_SOUND_INFO:
            for _, info in _read_messages(reader, connection):
                formats = (info.coding_format, _CODINGS), (info.sample_format, _SAMPLES)
                for found, known in formats:
                    if found not in known:
                        expected = "sound as 16-bit samples, S16LE"
                        raise InputError(f"{path}: expected {expected}, found '{found}'")
                rate_hz, channels = int(info.sample_rate), int(info.channels)
                break
    return rate_hz, channels

"""What a recording holds, as stamped messages in order of time.

Times count from the recording's own zero, that of its video and its sound.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import av
import cv2
import numpy as np
import soundfile
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError, reason_of
from afferents.recordings import ros_messages
from afferents.recordings.ros_messages import NS, Messages
from afferents.recordings.video import VideoFile
from afferents.store.drum_path import Way
from afferents.store.recording import Vibration, Video
from afferents.store.responses import Responses

CAMERA, MARKERS, POSITIONS = "/camera/image/compressed", "/camera/markers", "/touch/positions"
SOUND, VIBRATION, PERCEPT = "/microphone", "/touch/ra2", "/touch/percept"
DRUM_POSITION, DRUM_SPEED = "/drum/position_mm", "/drum/speed_mm_s"
BLOCK_S = 0.1
QUALITY = 95
"""Of JPEGs, where the camera gave none."""
_FULL = 32767


class Stamped(NamedTuple):
    """A message."""

    at_ns: int
    topic: str
    type: str
    data: bytes


def pictures(make: Messages, video: Video, quality: int) -> Iterator[Stamped]:
    """Yield a video's frames: JPEGs as they are in the file, others encoded anew."""
    for at_s, data in jpegs(video, quality):
        at_ns = _ns(at_s)
        yield Stamped(at_ns, CAMERA, ros_messages.PICTURE, make.picture(at_ns, data))


def jpegs(video: Video, quality: int) -> Iterator[tuple[float, bytes]]:
    """Yield a video's frames as JPEGs, and when each was taken, s; see `pictures`."""
    if isinstance(video, VideoFile):
        with av.open(f"file:{video.path}") as container:
            stream = container.streams.video[0]
            if stream.codec_context.name == "mjpeg":
                n = 0
                for packet in container.demux(stream):
                    if packet.size and packet.pts is not None and packet.time_base is not None:
                        shown_s = float(packet.pts * packet.time_base)
                        yield n / video.rate_hz if video.rate_hz else shown_s, bytes(packet)
                        n += 1
                return
    for frame in video.frames():
        picture = frame.in_colour() if frame.in_colour else frame.image
        done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
        if not done:
            raise InputError(
                f"{video.path}: expected frames that can be encoded as JPEG, found one that can't"
            )
        yield frame.time_s, data.tobytes()


def sound_of_file(make: Messages, audio: Vibration) -> Iterator[Stamped]:
    """Yield all channels of a sound file in blocks of a tenth of a second."""
    try:
        with soundfile.SoundFile(audio.path) as file:
            rate_hz, first = file.samplerate, 0
            size = max(1, round(BLOCK_S * rate_hz))
            while len(samples := file.read(size, dtype="int16", always_2d=True)):
                yield _sounds(make, first, samples, rate_hz)
                first += len(samples)
    except soundfile.SoundFileError as error:
        raise InputError(
            f"{audio.path}: expected a readable sound file, found {reason_of(error)}"
        ) from error


def sound_of_store(make: Messages, responses: Responses) -> Iterator[Stamped]:
    """Yield the vibration of a store: as sound if it is some, else as numbers."""
    if dims.RA2 not in responses:
        return
    vibration = responses[dims.RA2]
    rate_hz = float(vibration.attrs[dims.SAMPLE_RATE])
    heard = vibration.attrs.get(dims.UNITS) == "full scale" and rate_hz == round(rate_hz)
    size = max(1, round(BLOCK_S * rate_hz))
    for first in range(0, len(vibration), size):
        values = vibration[first : first + size].values
        if heard:
            samples = np.clip(np.rint(values * _FULL), -_FULL - 1, _FULL).astype(np.int16)
            yield _sounds(make, first, samples, round(rate_hz))
        else:
            data = make.numbers(values, (dims.AUDIO_TIME, dims.CHANNEL))
            yield Stamped(_ns(first / rate_hz), VIBRATION, ros_messages.NUMBERS, data)


def _sounds(make: Messages, first: int, samples: NDArray[np.int16], rate_hz: int) -> Stamped:
    at_ns = first * NS // rate_hz
    return Stamped(at_ns, SOUND, ros_messages.SOUND, make.sound(at_ns, samples, rate_hz))


def markers(make: Messages, responses: Responses) -> Iterator[Stamped]:
    """Yield where the markers are, SA-I and RA-I of each frame."""
    if dims.POSITION not in responses:
        return
    names = [name for name in (dims.SA1, dims.RA1) if name in responses]
    values = {name: responses[name].values for name in names}
    position = responses[dims.POSITION].values
    for n, at_s in enumerate(responses[dims.TIME].values.tolist()):
        at_ns = _ns(at_s)
        yield Stamped(at_ns, MARKERS, ros_messages.MARKS, make.marks(at_ns, position[n]))
        data = make.numbers(position[n], (dims.MARKER, dims.SPACE))
        yield Stamped(at_ns, POSITIONS, ros_messages.NUMBERS, data)
        for name, value in values.items():
            data = make.numbers(value[n], (dims.MARKER,))
            yield Stamped(at_ns, f"/touch/{name}", ros_messages.NUMBERS, data)


def drum(make: Messages, way: Way | None) -> Iterator[Stamped]:
    """Yield the way of the drum's surface, mm, and its speed, mm/s; None where nobody logged it."""
    if way is None:
        return
    speed = np.gradient(way.position_mm, way.time_s)
    for at_s, position, at_speed in zip(way.time_s, way.position_mm, speed, strict=True):
        at_ns = _ns(at_s)
        yield Stamped(at_ns, DRUM_POSITION, ros_messages.NUMBER, make.number(position))
        yield Stamped(at_ns, DRUM_SPEED, ros_messages.NUMBER, make.number(at_speed))


def percepts(make: Messages, path: Path | None) -> Iterator[Stamped]:
    """Yield the lines that ``live --json`` wrote, in order of time."""
    if path is None:
        return
    found: list[tuple[int, str]] = []
    try:
        for line in filter(None, map(str.strip, path.read_text().splitlines())):
            said: dict[str, Any] = json.loads(line)
            if "time_s" in said:
                found.append((_ns(said["time_s"]), line))
    except (OSError, ValueError, TypeError) as error:
        expected = "lines that 'afferents live --json' wrote"
        raise InputError(f"{path}: expected {expected}, found {reason_of(error)}") from error
    for at_ns, line in sorted(found):
        yield Stamped(at_ns, PERCEPT, ros_messages.TEXT, make.text(line))


def _ns(at_s: float) -> int:
    """Return a time as whole ns; a time before the zero is 0, since bags know none."""
    return max(0, round(float(at_s) * NS))

"""What a run leaves on disk: frames as they came, each with its own time, and sound."""

import os
import struct
from abc import ABC, abstractmethod
from fractions import Fraction
from pathlib import Path
from typing import ClassVar, cast

import av
import numpy as np
from av.container import OutputContainer
from av.video.reformatter import ColorRange
from av.video.stream import VideoStream
from numpy.typing import NDArray

from afferents.devices.base import CameraSettings
from afferents.errors import InputError

# A camera's frames on disk: JPEGs as they came, raw pixels without loss, each with its own time.
#
# The file is a fragmented mp4, a fragment a second: whatever ends the program, all but the last
# second can be read. Times are those of capture, to a microsecond.

TICKS_HZ = 1_000_000
TIME_BASE = Fraction(1, TICKS_HZ)
_FRAGMENT_S = 1
CONTAINER = {
    # frag_discont: the first frame keeps its time, and is not moved to 0.
    "movflags": "empty_moov+default_base_moof+frag_discont",
    "frag_duration": str(_FRAGMENT_S * TICKS_HZ),
    "flush_packets": "1",
    "video_track_timescale": str(TICKS_HZ),
    "avoid_negative_ts": "disabled",
}
Pixels = NDArray[np.uint8]


class Stored(ABC):
    """How frames of one format are stored."""

    format: ClassVar[str]
    how: ClassVar[str]

    def __init__(self, container: OutputContainer, settings: CameraSettings) -> None:
        """Add a stream to the file."""
        self._size = settings.width, settings.height
        self._container = container
        self._stream = self._added(round(settings.fps_hz))
        self._stream.time_base = TIME_BASE

    @abstractmethod
    def _added(self, rate: int) -> VideoStream:
        """Add the stream to the container."""

    @abstractmethod
    def write(self, data: bytes, ticks: int) -> None:
        """Write a frame."""

    def finish(self) -> None:
        """Write what an encoder holds back; most hold nothing."""
        return


class Jpegs(Stored):
    """JPEGs, byte for byte."""

    format, how = "MJPG", "as they came from the camera"

    def _added(self, rate: int) -> VideoStream:
        width, height = self._size
        stream = self._container.add_mux_stream("mjpeg", rate=rate, width=width, height=height)
        return cast(VideoStream, stream)

    def write(self, data: bytes, ticks: int) -> None:
        """Put it into the file as it is."""
        packet = av.Packet(data)
        packet.stream, packet.time_base = self._stream, TIME_BASE
        packet.pts = packet.dts = ticks
        packet.is_keyframe = True
        self._container.mux(packet)


class _Lossless(Stored):
    """Raw pixels, as H.264 without loss: quick, and every value is kept."""

    how = "without loss (H.264)"
    layout: ClassVar[str]
    levels: ClassVar[ColorRange]
    """Which values black and white are: players and trackers would stretch the wrong ones."""

    def _added(self, rate: int) -> VideoStream:
        options = {"preset": "ultrafast", "qp": "0", "tune": "zerolatency", "threads": "1"}
        stream = self._container.add_stream("libx264", rate=rate, options=options)
        stream.width, stream.height, stream.pix_fmt = *self._size, self.layout
        stream.codec_context.time_base = TIME_BASE
        stream.codec_context.gop_size = rate
        stream.codec_context.color_range = self.levels
        return stream

    def write(self, data: bytes, ticks: int) -> None:
        """Encode it."""
        frame = av.VideoFrame(*self._size, self.layout)
        for plane, pixels in zip(frame.planes, self._planes(data), strict=True):
            plane.update(_padded(pixels, plane.line_size))
        frame.pts, frame.time_base = ticks, TIME_BASE
        self._container.mux(self._stream.encode(frame))

    @abstractmethod
    def _planes(self, data: bytes) -> tuple[Pixels, ...]:
        """Return what each plane of the picture holds, (height, width) each."""

    def finish(self) -> None:
        """Write what the encoder holds back."""
        self._container.mux(self._stream.encode(None))


class Grey(_Lossless):
    """A byte a pixel."""

    format, layout, levels = "GREY", "gray", ColorRange.JPEG

    def _planes(self, data: bytes) -> tuple[Pixels, ...]:
        width, height = self._size
        return (np.frombuffer(data, np.uint8, width * height).reshape(height, width),)


class Yuyv(_Lossless):
    """Four bytes for two pixels: luma, blue, luma, red."""

    format, layout, levels = "YUYV", "yuv422p", ColorRange.MPEG

    def _planes(self, data: bytes) -> tuple[Pixels, ...]:
        width, height = self._size
        rows = np.frombuffer(data, np.uint8, 2 * width * height).reshape(height, 2 * width)
        return rows[:, ::2], rows[:, 1::4], rows[:, 3::4]


FORMATS: dict[str, type[Stored]] = {kind.format: kind for kind in (Jpegs, Grey, Yuyv)}


def _padded(pixels: Pixels, width: int) -> bytes:
    return np.pad(pixels, ((0, 0), (0, width - pixels.shape[1]))).tobytes()


class Film:
    """A video that is being recorded; closing it twice is no error.

    Parameters
    ----------
    path
        File to write.
    settings
        Of the camera.

    Raises
    ------
    InputError
        If frames of this format can't be stored.
    """

    def __init__(self, path: Path, settings: CameraSettings) -> None:
        """Open the file."""
        self.path = path
        kind = FORMATS.get(settings.format)
        if kind is None:
            raise InputError(
                f"{settings.name}: expected a camera of format {', '.join(FORMATS)}, found "
                f"{settings.format}; choose another format in [camera]"
            )
        self._container = av.open(f"file:{path}", "w", format="mp4", options=CONTAINER)
        self._stored = kind(self._container, settings)
        self._last = -1
        self._closed = False

    def write(self, data: bytes, time_s: float) -> None:
        """Write a frame; of two of one microsecond the second is written one later.

        Raises
        ------
        OSError
            If the disk is full.
        """
        self._last = max(round(time_s * TICKS_HZ), self._last + 1)
        self._stored.write(data, self._last)

    def close(self) -> None:
        """Write what is left.

        Raises
        ------
        OSError
            If the disk is full.
        """
        if self._closed:
            return
        self._closed = True
        try:
            self._stored.finish()
        finally:
            self._container.close()


# A microphone's samples on disk: a wav whose header is right every second, and its repair.

_HEADER = struct.Struct("<4sI4s4sIHHIIHH4sI")
_DATA_AT = _HEADER.size - 8
SAMPLE_BYTES = 2
LONGEST_BYTES = 0xFFFFFFFF - _HEADER.size
"""A wav says in 32 bits how much there is."""


class Sound:
    """A 16-bit wav that is being recorded; closing it twice is no error.

    Parameters
    ----------
    path
        File to write.
    rate_hz, channels
        Of the microphone.
    """

    def __init__(self, path: Path, rate_hz: float, channels: int) -> None:
        """Open the file."""
        self.path = path
        self._rate_hz, self._channels = round(rate_hz), channels
        self.n_samples = 0
        self._patched = 0
        self._file = path.open("wb", buffering=0)
        self._file.write(_header(self._rate_hz, channels, 0))

    def write(self, samples: NDArray[np.int16]) -> None:
        """Write samples, (n, channel).

        Raises
        ------
        OSError
            If the disk is full.
        """
        content = np.ascontiguousarray(samples, "<i2").tobytes()
        written = self._file.write(content)
        if written != len(content):
            raise OSError(28, os.strerror(28), str(self.path))
        self.n_samples += len(samples)
        if self.n_samples - self._patched >= self._rate_hz:
            self._patch()

    def close(self) -> None:
        """Write the last length."""
        if not self._file.closed:
            try:
                self._patch()
            finally:
                self._file.close()

    def _patch(self) -> None:
        """Write into the header how much there is."""
        self._patched = self.n_samples
        head = _header(self._rate_hz, self._channels, self.n_samples)
        self._file.seek(0)
        self._file.write(head)
        self._file.seek(0, os.SEEK_END)


def repair(path: Path) -> int:
    """Let the header of a wav of ours, whose recording broke off, say what is in the file.

    Returns
    -------
    Samples a channel that are in it now; 0 where there is no such file.

    Raises
    ------
    InputError
        If it is no wav that was recorded here.
    """
    if not path.is_file():
        return 0
    with path.open("r+b") as file:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return 0
        fields = _HEADER.unpack(head)
        if (fields[0], fields[2], fields[11]) != (b"RIFF", b"WAVE", b"data"):
            raise InputError(
                f"{path}: expected a wav that 'afferents record' began, found another file"
            )
        channels, rate_hz = fields[6], fields[7]
        n: int = (path.stat().st_size - _HEADER.size) // (SAMPLE_BYTES * channels)
        file.truncate(_HEADER.size + n * SAMPLE_BYTES * channels)
        file.seek(0)
        file.write(_header(rate_hz, channels, n))
    return n


def _header(rate_hz: int, channels: int, n_samples: int) -> bytes:
    frame = SAMPLE_BYTES * channels
    n_bytes = min(n_samples * frame, LONGEST_BYTES // frame * frame)
    return _HEADER.pack(
        b"RIFF", n_bytes + _DATA_AT, b"WAVE", b"fmt ", 16, 1, channels, rate_hz,
        rate_hz * frame, frame, 8 * SAMPLE_BYTES, b"data", n_bytes,
    )  # fmt: skip

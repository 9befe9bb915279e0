"""A camera's frames on disk: JPEGs as they came, raw pixels without loss, each with its own time.

The file is a fragmented mp4, a fragment a second: whatever ends the program, all but the last
second can be read. Times are those of capture, to a microsecond.
"""

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

from afferents.core.errors import InputError
from afferents.devices import CameraSettings

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
                settings.name, f"a camera of format {', '.join(FORMATS)}", settings.format,
                "choose another format in [camera]",
            )  # fmt: skip
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

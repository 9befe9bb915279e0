"""What a run leaves on disk: frames as they came, each with its own time, and sound."""

import os
import struct
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import ColorRange
from numpy.typing import NDArray

from afferents.devices.base import CameraSettings
from afferents.errors import InputError

# The video is a fragmented mp4, a fragment a second: whatever ends the program, all but the last
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
_RAW = {"GREY": ("gray", ColorRange.JPEG), "YUYV": ("yuv422p", ColorRange.MPEG)}
"""Layout of raw formats in the file, and which values black and white are: players and trackers
would stretch the wrong ones."""
FORMATS = ("MJPG", *_RAW)


class VideoWriter:
    """A video that is being recorded: JPEGs byte for byte, raw pixels as H.264 without loss.

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
        if settings.format not in FORMATS:
            raise InputError(
                f"{settings.name}: expected a camera of format {', '.join(FORMATS)}, found "
                f"{settings.format}; choose another format in [camera]"
            )
        self.path = path
        self._format, self._size = settings.format, (settings.width, settings.height)
        self._container = av.open(f"file:{path}", "w", format="mp4", options=CONTAINER)
        self._stream: Any = self._add_stream(round(settings.fps_hz))
        self._stream.time_base = TIME_BASE
        self._last = -1

    def _add_stream(self, rate: int) -> Any:
        width, height = self._size
        if self._format == "MJPG":
            return self._container.add_mux_stream("mjpeg", rate=rate, width=width, height=height)
        options = {"preset": "ultrafast", "qp": "0", "tune": "zerolatency", "threads": "1"}
        stream = self._container.add_stream("libx264", rate=rate, options=options)
        stream.width, stream.height = self._size
        stream.pix_fmt, stream.codec_context.color_range = _RAW[self._format]
        stream.codec_context.time_base = TIME_BASE
        stream.codec_context.gop_size = rate
        return stream

    def write(self, data: bytes, time_s: float) -> None:
        """Write a frame; of two of one microsecond the second is written one later.

        Raises
        ------
        OSError
            If the disk is full.
        """
        self._last = max(round(time_s * TICKS_HZ), self._last + 1)
        if self._format != "MJPG":
            self._container.mux(self._stream.encode(self._raw_frame(data)))
            return
        packet = av.Packet(data)
        packet.stream, packet.time_base = self._stream, TIME_BASE
        packet.pts = packet.dts = self._last
        packet.is_keyframe = True
        self._container.mux(packet)

    def _raw_frame(self, data: bytes) -> av.VideoFrame:
        """Return raw pixels as a frame; YUYV has four bytes for two: luma, blue, luma, red."""
        width, height = self._size
        values = np.frombuffer(data, np.uint8)
        if self._format == "GREY":
            planes = [values[: width * height].reshape(height, width)]
        else:
            rows = values[: 2 * width * height].reshape(height, 2 * width)
            planes = [rows[:, ::2], rows[:, 1::4], rows[:, 3::4]]
        frame = av.VideoFrame(width, height, _RAW[self._format][0])
        for plane, pixels in zip(frame.planes, planes, strict=True):
            padding = ((0, 0), (0, plane.line_size - pixels.shape[1]))
            plane.update(np.pad(pixels, padding).tobytes())
        frame.pts, frame.time_base = self._last, TIME_BASE
        return frame

    def close(self) -> None:
        """Write what is left.

        Raises
        ------
        OSError
            If the disk is full.
        """
        try:
            if self._format != "MJPG":
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()


# A microphone's samples: a wav whose header is right with each block, and its repair.

_HEADER = struct.Struct("<4sI4s4sIHHIIHH4sI")
HEADER_BYTES, SAMPLE_BYTES = _HEADER.size, 2


class SoundWriter:
    """A 16-bit wav that is being recorded.

    Parameters
    ----------
    path
        File to write.
    rate_hz, channels
        Of the microphone.
    """

    def __init__(self, path: Path, rate_hz: float, channels: int) -> None:
        """Open the file."""
        self.path, self.n_samples = path, 0
        self._rate_hz, self._channels = round(rate_hz), channels
        self._file = path.open("wb")
        self.write(np.empty((0, channels), np.int16))

    def write(self, samples: NDArray[np.int16]) -> None:
        """Write samples, (n, channel), and into the header how much there is.

        Raises
        ------
        OSError
            If the disk is full.
        """
        head = _header(self._rate_hz, self._channels, self.n_samples + len(samples))
        self._file.seek(0, os.SEEK_END)  # samples first: a header never says more than there is
        self._file.write(np.ascontiguousarray(samples, "<i2").tobytes())
        self._file.seek(0)
        self._file.write(head)
        self._file.flush()
        self.n_samples += len(samples)

    def close(self) -> None:
        """Let it go."""
        self._file.close()


def repair(path: Path) -> None:
    """Let the header of a wav of ours, whose recording broke off, say what is in the file."""
    if not path.is_file() or path.stat().st_size < HEADER_BYTES:
        return
    with path.open("r+b") as file:
        channels, rate_hz = _HEADER.unpack(file.read(HEADER_BYTES))[6:8]
        if not channels:  # lost with the power: nothing says what the samples are
            return
        n = (path.stat().st_size - HEADER_BYTES) // (SAMPLE_BYTES * channels)
        file.truncate(HEADER_BYTES + n * SAMPLE_BYTES * channels)
        file.seek(0)
        file.write(_header(rate_hz, channels, n))


def _header(rate_hz: int, channels: int, n_samples: int) -> bytes:
    a_sample = SAMPLE_BYTES * channels
    n_bytes = n_samples * a_sample
    return _HEADER.pack(
        b"RIFF", n_bytes + HEADER_BYTES - 8, b"WAVE", b"fmt ", 16, 1, channels, rate_hz,
        rate_hz * a_sample, a_sample, 8 * SAMPLE_BYTES, b"data", n_bytes,
    )  # fmt: skip

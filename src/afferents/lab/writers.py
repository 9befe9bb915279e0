"""What a run leaves on disk: frames as they came, each with its own time, and sound.

Whatever ends the program, what was written before can be read: the video is a fragmented mp4, and
the header of the wav is right with each block.
"""

import struct
import wave
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import ColorRange
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.lab.devices.base import CameraSettings

TICKS_HZ = 1_000_000
"""Times of a video are those of capture, to a microsecond."""
TIME_BASE = Fraction(1, TICKS_HZ)
_FRAGMENT_S = 1
"""All but the last fragment of a video can be read."""
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
HEADER_BYTES, SAMPLE_BYTES = 44, 2
_LENGTHS_AT = (4, 40)
"""Where a wav's header holds the bytes after its eighth, and the bytes of samples."""


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
        self._format, self._size = settings.format, (settings.width, settings.height)
        self._container = av.open(f"file:{path}", "w", format="mp4", options=CONTAINER)
        codec, options, rate = "mjpeg", {"threads": "1"}, round(settings.fps_hz)
        if settings.format in _RAW:
            codec = "libx264"
            options |= {"preset": "ultrafast", "qp": "0", "tune": "zerolatency"}
        stream: Any = self._container.add_stream(codec, rate=rate, options=options)
        stream.width, stream.height = self._size
        if settings.format in _RAW:
            stream.pix_fmt, stream.codec_context.color_range = _RAW[settings.format]
            stream.codec_context.time_base = TIME_BASE
            stream.codec_context.gop_size = rate
        else:  # an encoder that has nothing to do, as in `rig.record`
            stream.pix_fmt = "yuvj420p"
        stream.time_base = TIME_BASE
        self._stream = stream
        self._last = -1

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
        self.n_samples = 0
        self._file = path.open("wb")
        self._wav = wave.open(self._file, "wb")  # noqa: SIM115 (closed below)
        self._wav.setparams((channels, SAMPLE_BYTES, round(rate_hz), 0, "NONE", ""))
        self.write(np.empty((0, channels), np.int16))

    def write(self, samples: NDArray[np.int16]) -> None:
        """Write samples, (n, channel), and into the header how many there are.

        Samples come first: a header never states more than there is.

        Raises
        ------
        OSError
            If the disk is full.
        """
        self._wav.writeframes(np.ascontiguousarray(samples, "<i2").tobytes())
        self._file.flush()
        self.n_samples += len(samples)

    def close(self) -> None:
        """Let it go."""
        with self._file:
            self._wav.close()


def repair(path: Path) -> None:
    """Correct the header of a wav of ours, whose recording broke off, by what is in the file."""
    try:
        with wave.open(str(path)) as wav:
            a_sample = SAMPLE_BYTES * wav.getnchannels()
    except (OSError, EOFError, wave.Error):  # none, or lost with the power: what are the samples?
        return
    n_bytes = (path.stat().st_size - HEADER_BYTES) // a_sample * a_sample
    with path.open("r+b") as file:
        file.truncate(HEADER_BYTES + n_bytes)
        for at in _LENGTHS_AT:
            file.seek(at)
            file.write(struct.pack("<I", n_bytes + _LENGTHS_AT[1] - at))

"""A camera through PyAV (FFmpeg), where there is no V4L2: macOS and Windows.

FFmpeg hides the driver's numbers: what can't be known stands in the settings as `unknown`.
"""

import sys
import time
from collections.abc import Iterator
from typing import Any, Literal

import av
from av.container import InputContainer

from afferents.errors import InputError, reason_of
from afferents.lab.devices.base import Camera, CameraOptions, CameraSettings, Frame, not_free
from afferents.lab.devices.clock import HostClock

DRIVERS = {"linux": "v4l2", "darwin": "avfoundation", "win32": "dshow"}
"""FFmpeg's readers of cameras, by system."""
RAW = {"rawvideo gray": "GREY", "rawvideo yuyv422": "YUYV"}
"""Raw formats that are kept as they come; others are turned into grey."""
UNKNOWN = (
    "how many frames were lost (they are numbered here, as they arrive)",
    "when a frame was captured (FFmpeg's stamp, less the least delay)",
    "whether the camera adapts exposure, gain, white balance or focus",
)


class PortableOptions(CameraOptions):
    """A camera through FFmpeg: the options that FFmpeg adds.

    Attributes
    ----------
    device
        As FFmpeg's reader names it: a number on macOS, ``video=NAME`` on Windows.
    driver
        FFmpeg's reader; None for the system's.
    """

    kind: Literal["portable"] = "portable"
    device: str = "0"
    driver: str | None = None


class PortableCamera(Camera):
    """A camera through FFmpeg: JPEGs as they came where the camera gives them, else raw pixels."""

    Options = PortableOptions
    options: PortableOptions

    def __init__(self, options: PortableOptions) -> None:
        """Touch nothing yet."""
        super().__init__(options)
        self._driver = options.driver or DRIVERS.get(sys.platform, "v4l2")

    def open(self) -> None:
        """Open it.

        Raises
        ------
        InputError
            If there is none, it is busy, or it gives another size.
        """
        self._ended.clear()
        container = self._open_container()
        stream = container.streams.video[0]
        options, found = self.options, (stream.width, stream.height)
        wanted = (options.width or found[0], options.height or found[1])
        if found != wanted:
            container.close()
            raise InputError(
                f"camera {options.device}: expected {wanted[0]} x {wanted[1]} px, found {found[0]} "
                f"x {found[1]} px; ask for a size that it has"
            )
        self._handle = container
        rate = stream.guessed_rate or stream.average_rate or options.fps_hz or "nan"
        self.settings = CameraSettings(
            options.device, _kept_format(stream) or "GREY", *found, float(rate), {}, UNKNOWN
        )

    def frames(self) -> Iterator[Frame]:
        """Yield what FFmpeg gives, numbered here; in grey where its format has no name."""
        container: InputContainer = self._begin()
        stream, clock = container.streams.video[0], HostClock()
        try:
            for sequence, packet in enumerate(container.demux(stream)):
                arrived_s = time.monotonic()
                if self._ended.is_set():
                    return
                if packet.size:
                    at_s, data = arrived_s, bytes(packet)
                    if packet.pts is not None:
                        at_s = float(packet.pts * packet.time_base)
                    if not _kept_format(stream):
                        grey = (frame.reformat(format="gray") for frame in packet.decode())
                        data = next((frame.to_ndarray().tobytes() for frame in grey), b"")
                    time_s = clock.read(at_s, arrived_s)
                    yield Frame(sequence, time_s, packet.is_corrupt or not data, data)
        except (av.FFmpegError, OSError) as error:
            raise self._lost(reason_of(error).lower()) from error
        raise self._lost("no more frames")

    def _open_container(self) -> InputContainer:
        options, mode = self.options, {"fflags": "nobuffer"}
        modes = [mode]
        if self._driver in DRIVERS.values():
            if options.width is not None and options.height is not None:
                mode = mode | {"video_size": f"{options.width}x{options.height}"}
            if options.fps_hz is not None:
                mode = mode | {"framerate": f"{options.fps_hz:g}"}
            # Readers have their own words for JPEG, and pass over one that they do not know; a
            # camera that can't be opened with one is tried without.
            modes = [mode | {"input_format": "mjpeg"}, mode | {"vcodec": "mjpeg"}, mode]
        for wanted in modes:
            try:
                return av.open(options.device, format=self._driver, options=wanted)
            except (av.FFmpegError, OSError, ValueError) as error:
                last = error
        do = "close what else uses it, or name another"
        raise not_free(f"camera {options.device}", "a camera", last, do) from last


def _kept_format(stream: Any) -> str:
    """Return the name of what is kept as it comes; none for what must be decoded."""
    coded = stream.codec_context
    return "MJPG" if coded.name == "mjpeg" else RAW.get(f"{coded.name} {coded.pix_fmt}", "")

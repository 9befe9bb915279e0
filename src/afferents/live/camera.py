"""A running camera: V4L2 through PyAV on Linux, OpenCV elsewhere."""

import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import closing

import av
import cv2
import numpy as np

from afferents.core.errors import InputError
from afferents.core.recording import Frame
from afferents.live.clock import HostClock
from afferents.live.events import CameraFrame, Channel, Event, Trouble
from afferents.live.exposure import set_exposure
from afferents.recordings import luma_of

AGAIN_S = 1.0
"""A camera that vanished is looked for this often, s."""
CHECKED_S = 1.0
"""Its frame rate is measured over this time, s."""
USUAL_HZ = 30.0
"""Frame rate of a camera that was asked for none and says none."""
SLOW = 0.9
"""A rate below this share of what was asked for is said."""


class Camera:
    """Frames of a camera as they come; when it vanishes it is waited for.

    Parameters
    ----------
    device
        Its number, or its path such as ``/dev/video0``.
    fps_hz
        Frames a second asked for; None for the camera's own.
    width, height
        Size asked for, px; None for the camera's own.
    exposure_ms
        Exposure time asked for, ms; None leaves it as it is. Linux only.
    driver
        FFmpeg's input format; None for OpenCV.

    Raises
    ------
    InputError
        If there is no such camera, it is busy, or can't be set so.
    """

    channel: Channel = "video"
    speed = 1.0

    def __init__(
        self,
        device: str,
        fps_hz: float | None = None,
        width: int | None = None,
        height: int | None = None,
        exposure_ms: float | None = None,
        driver: str | None = "v4l2" if sys.platform == "linux" else None,
    ) -> None:
        """Open it."""
        self._fps_hz = fps_hz
        self.rate_hz = fps_hz or USUAL_HZ
        self._size = None if width is None or height is None else (width, height)
        self._exposure_ms, self._driver = exposure_ms, driver
        self._device = f"/dev/video{device}" if driver == "v4l2" and device.isdigit() else device
        self._closed = False
        self._taken: deque[float] = deque()
        self._said_s = -np.inf
        self._opened: Iterator[CameraFrame] | None = self._open()

    def close(self) -> None:
        """Let it go."""
        self._closed = True

    def events(self) -> Iterator[Event]:
        """Yield its frames; `Trouble` when it vanishes, comes back, or is too slow."""
        last_s = 0.0
        while not self._closed:
            frames, self._opened = self._opened or self._reopened(), None
            if frames is None:
                time.sleep(AGAIN_S)
                continue
            try:
                for picture in frames:
                    if self._closed:
                        return
                    last_s = picture.time_s
                    yield picture
                    yield from self._slowness(picture)
            except (av.FFmpegError, cv2.error, OSError, InputError) as error:
                reason = getattr(error, "strerror", None) or str(error)
                yield Trouble("video", last_s, f"camera {self._device}: lost ({reason})")
            else:
                yield Trouble("video", last_s, f"camera {self._device}: no more frames")
            time.sleep(AGAIN_S)

    def _reopened(self) -> Iterator[CameraFrame] | None:
        try:
            return self._open()
        except InputError:
            return None

    def _open(self) -> Iterator[CameraFrame]:
        self._taken.clear()
        frames = self._by_opencv() if self._driver is None else self._by_ffmpeg(self._driver)
        if self._exposure_ms is not None:
            set_exposure(self._device, self._exposure_ms)
        return frames

    def _by_ffmpeg(self, driver: str) -> Iterator[CameraFrame]:
        options = {"fflags": "nobuffer"}
        if driver == "v4l2":
            if self._size is not None:
                options["video_size"] = f"{self._size[0]}x{self._size[1]}"
            if self._fps_hz is not None:
                options["framerate"] = f"{self._fps_hz:g}"
        try:
            container = av.open(self._device, format=driver, options=options)
        except (av.FFmpegError, OSError) as error:
            raise self._absent(str(getattr(error, "strerror", None) or error)) from error
        stream = container.streams.video[0]
        found = (stream.width, stream.height)
        if self._fps_hz is None and stream.average_rate:
            self.rate_hz = float(stream.average_rate)
        if self._size is not None and found != self._size:
            container.close()
            raise InputError(
                self._device,
                f"a camera of {self._size[0]} x {self._size[1]} px, as the sensor has",
                f"{found[0]} x {found[1]} px",
            )

        def frames() -> Iterator[CameraFrame]:
            clock = HostClock()
            with closing(container):
                for frame in container.decode(stream):
                    arrived_s = time.monotonic()
                    stamp = arrived_s if frame.time is None else frame.time
                    seen = Frame(clock.read(stamp, arrived_s), *luma_of(frame))
                    yield CameraFrame(seen, arrived_s, frame.is_corrupt)

        return frames()

    def _by_opencv(self) -> Iterator[CameraFrame]:
        device = int(self._device) if self._device.isdigit() else self._device
        camera = cv2.VideoCapture(device)
        if not camera.isOpened():
            raise self._absent("none that can be opened")
        width, height = self._size or (None, None)
        for name, value in (
            (cv2.CAP_PROP_FRAME_WIDTH, width),
            (cv2.CAP_PROP_FRAME_HEIGHT, height),
            (cv2.CAP_PROP_FPS, self._fps_hz),
        ):
            if value is not None:
                camera.set(name, value)
        if self._fps_hz is None:
            self.rate_hz = camera.get(cv2.CAP_PROP_FPS) or USUAL_HZ

        def frames() -> Iterator[CameraFrame]:
            try:
                while True:
                    there, image = camera.read()
                    arrived_s = time.monotonic()
                    if not there:
                        return
                    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
                    yield CameraFrame(Frame(arrived_s, np.asarray(grey, np.uint8)), arrived_s)
            finally:
                camera.release()

        return frames()

    def _absent(self, why: str) -> InputError:
        return InputError(
            f"camera {self._device}",
            "a camera that is plugged in and free",
            why,
            "close what else uses it, or name another: --video camera:1",
        )

    def _slowness(self, picture: CameraFrame) -> Iterator[Trouble]:
        """Say, not too often, that frames come more slowly than asked for."""
        taken = self._taken
        taken.append(picture.time_s)
        if (span_s := taken[-1] - taken[0]) < CHECKED_S:
            return
        rate_hz = (len(taken) - 1) / span_s
        taken.clear()
        if rate_hz < SLOW * self.rate_hz and picture.time_s - self._said_s > 10 * CHECKED_S:
            self._said_s = picture.time_s
            what = f"camera {self._device}: asked {self.rate_hz:g} frames/s, got {rate_hz:.0f}"
            yield Trouble("video", picture.time_s, f"{what}; more light or another mode may help")

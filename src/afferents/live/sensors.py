"""The camera and the microphone that record (`afferents.devices`), to feel by."""

import sys
import time
from collections import deque
from collections.abc import Iterator

import numpy as np

from afferents import devices
from afferents.errors import AfferentsError, InputError
from afferents.live.events import CameraFrame, Channel, Event, Sound, Trouble
from afferents.store.recording import Frame

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

    JPEGs are asked for where the camera gives them, as when recording.

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
        FFmpeg's input format; None for the system's own.

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
        driver: str | None = None,
    ) -> None:
        """Open it."""
        self._device = device
        self._camera = _camera_of(device, fps_hz, (width, height), exposure_ms, driver)
        self._closed = self._running = False
        self._taken: deque[float] = deque()
        self._said_s = -np.inf
        self._camera.open()
        self._open = True
        said_hz = self._camera.settings.fps_hz
        self.rate_hz = fps_hz or (said_hz if said_hz > 0 else USUAL_HZ)  # not if it is NaN

    def close(self) -> None:
        """Let it go; where `events` runs, it does so at its end."""
        self._closed = True
        self._camera.end()
        if not self._running:
            self._camera.close()

    def events(self) -> Iterator[Event]:
        """Yield its frames; `Trouble` when it vanishes, comes back, or is too slow."""
        last_s, self._running = 0.0, True
        try:
            while not self._closed:
                if not self._open and not self._reopened():
                    time.sleep(AGAIN_S)
                    continue
                self._taken.clear()
                try:
                    for picture in self._pictures():
                        last_s = picture.time_s
                        yield picture
                        yield from self._slowness(picture)
                except AfferentsError as error:
                    yield Trouble("video", last_s, str(error))
                self._camera.close()
                self._open = False
                if not self._closed:
                    time.sleep(AGAIN_S)
        finally:
            self._camera.close()

    def _pictures(self) -> Iterator[CameraFrame]:
        for frame in self._camera.frames():
            if self._closed:
                return
            seen = devices.picture_of(frame.data, self._camera.settings)
            arrived_s = time.monotonic()
            if seen is not None:
                yield CameraFrame(Frame(frame.time_s, *seen), arrived_s, frame.damaged)

    def _reopened(self) -> bool:
        try:
            self._camera.open()
        except InputError:
            return False
        self._open = True
        return True

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


def _camera_of(
    device: str,
    fps_hz: float | None,
    size: tuple[int | None, int | None],
    exposure_ms: float | None,
    driver: str | None,
) -> devices.Camera:
    """Return this system's camera, unopened."""
    width, height = size
    if driver is None and sys.platform == "linux":
        linux = devices.V4l2Camera.Options(
            device=device, format="auto", width=width, height=height,
            fps_hz=fps_hz, exposure_ms=exposure_ms,
        )  # fmt: skip
        return devices.V4l2Camera(linux)
    if exposure_ms is not None:
        raise InputError(
            f"--exposure-ms: expected Linux, where it can be set, found {sys.platform}; leave it "
            "out"
        )
    portable = devices.PortableCamera.Options(
        device=device, driver=driver, width=width, height=height, fps_hz=fps_hz
    )
    return devices.PortableCamera(portable)


# A running microphone: the one that records (`afferents.devices`).

AGAIN_S = 1.0
"""A microphone that vanished is looked for this often, s."""
FULL_SCALE = 32768.0
"""Of 16-bit samples, as wav files have them."""


class Microphone:
    """Sound of a microphone as it comes; when it vanishes it is waited for.

    Parameters
    ----------
    device
        ``default``, or a number or part of the name as PortAudio lists them.
    rate_hz
        Sample rate asked for.
    n_channels
        Channels asked for.
    source
        Another microphone than PortAudio's.

    Raises
    ------
    InputError
        If PortAudio is missing, or there is no such microphone, or not of that rate.
    """

    channel: Channel = "audio"
    speed = 1.0

    def __init__(
        self,
        device: str,
        rate_hz: float,
        n_channels: int = 1,
        source: devices.Microphone | None = None,
    ) -> None:
        """Open it."""
        self.rate_hz = rate_hz
        options = devices.PortAudioMicrophone.Options(
            device=device, rate_hz=rate_hz, channels=n_channels
        )
        self._source = source or devices.PortAudioMicrophone(options)
        self._closed = self._running = False
        self._source.open()

    def close(self) -> None:
        """Let it go; where `events` runs, it does so at its end."""
        self._closed = True
        self._source.end()
        if not self._running:
            self._source.close()

    def events(self) -> Iterator[Event]:
        """Yield its sound; `Trouble` when samples are lost, when it vanishes or comes back."""
        now_s, self._running = 0.0, True
        try:
            while not self._closed:
                try:
                    for event in self._heard():
                        now_s = event.time_s
                        yield event
                except AfferentsError as error:
                    yield Trouble("audio", now_s, str(error))
                    self._reopen()
        finally:
            self._source.close()

    def _heard(self) -> Iterator[Event]:
        count = devices.SampleClock(self.rate_hz)
        for block in self._source.blocks():
            if self._closed:
                return
            if block.overflowed:
                yield Trouble("audio", count.next_s, "microphone: overrun, samples are lost")
                count = devices.SampleClock(self.rate_hz)
            samples = block.samples.astype(np.float32) / FULL_SCALE
            time_s = count.read(len(samples), block.time_s, block.time_s)
            yield Sound(time_s, samples, time.monotonic())

    def _reopen(self) -> None:
        """Wait, and try once to open it again."""
        self._source.close()
        time.sleep(AGAIN_S)
        if self._closed:
            return
        try:
            self._source.open()
        except InputError:
            return

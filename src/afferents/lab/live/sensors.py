"""The camera and the microphone that record (`afferents.lab.devices`), as live sources."""

import sys
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from afferents.errors import AfferentsError, InputError
from afferents.lab import devices
from afferents.lab.devices.base import FULL_SCALE
from afferents.lab.live.events import CameraFrame, Channel, Event, Sound, Trouble
from afferents.store.recording import Frame

AGAIN_S = 1.0
"""A device that vanished is looked for this often, s."""
CHECKED_S = 1.0
"""A camera's frame rate is measured over this time, s."""
USUAL_HZ = 30.0
"""Frame rate of a camera that was given none and states none."""
SLOW = 0.9
"""A rate below this share of what was requested is reported."""


class DeviceSource(ABC):
    """What a device gives as it comes; when it vanishes it is waited for.

    Parameters
    ----------
    device
        Opened here.
    """

    channel: Channel
    speed = 1.0

    def __init__(self, device: devices.Camera | devices.Microphone) -> None:
        """Open it."""
        self._opened = device
        self._closed = self._running = False
        device.open()

    @abstractmethod
    def _take(self) -> Iterator[Event]:
        """Yield what the device gives until it is ended or vanishes."""

    def close(self) -> None:
        """Let it go; where `events` runs, it does so at its end."""
        self._closed = True
        self._opened.end()
        if not self._running:
            self._opened.close()

    def events(self) -> Iterator[Event]:
        """Yield what it gives; `Trouble` when it vanishes or gives too little."""
        now_s, self._running, is_open = 0.0, True, True
        try:
            while not self._closed:
                try:
                    if not is_open:
                        self._opened.open()
                        is_open = True
                    for event in self._take():
                        if self._closed:  # by another thread
                            return  # type: ignore[unreachable]
                        now_s = event.time_s
                        yield event
                except AfferentsError as error:
                    if is_open:
                        yield Trouble(self.channel, now_s, str(error))
                self._opened.close()
                is_open = False
                if not self._closed:
                    time.sleep(AGAIN_S)
        finally:
            self._opened.close()


class Camera(DeviceSource):
    """Frames of a camera as they come.

    JPEGs are requested where the camera gives them, as when recording.

    Parameters
    ----------
    device
        Its number, or its path such as ``/dev/video0``.
    fps_hz
        Frames a second to request; None for the camera's own.
    width, height
        Size to request, px; None for the camera's own.
    exposure_ms
        Exposure time to set, ms; None leaves it as it is. Linux only.
    driver
        FFmpeg's input format; None for the system's own.

    Raises
    ------
    InputError
        If there is no such camera, it is busy, or can't be set so.
    """

    channel: Channel = "video"

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
        settings = {"device": device, "width": width, "height": height, "fps_hz": fps_hz}
        if driver is None and sys.platform == "linux":
            settings |= {"kind": "v4l2", "format": "auto", "exposure_ms": exposure_ms}
        elif exposure_ms is None:
            settings |= {"kind": "portable", "driver": driver}
        else:
            raise InputError(
                f"--exposure-ms: expected Linux, where it can be set, found {sys.platform}; leave "
                "it out"
            )
        self._camera = devices.make_device(devices.CAMERAS, settings, f"camera {device}")
        self._taken: deque[float] = deque()
        self._reported_s = -np.inf
        super().__init__(self._camera)
        own_hz = self._camera.settings.fps_hz
        self.rate_hz = own_hz if own_hz > 0 else fps_hz or USUAL_HZ  # NaN: it states none
        self._wanted_hz = fps_hz or self.rate_hz

    def _take(self) -> Iterator[Event]:
        self._taken.clear()
        for frame in self._camera.frames():
            seen = devices.decode_picture(frame.data, self._camera.settings)
            arrived_s = time.monotonic()
            if seen is not None:
                yield CameraFrame(Frame(frame.time_s, *seen), arrived_s, frame.damaged)
                yield from self._report_slowness(frame.time_s)

    def _report_slowness(self, time_s: float) -> Iterator[Trouble]:
        """Report, not too often, that frames come more slowly than requested."""
        taken = self._taken
        taken.append(time_s)
        if (span_s := taken[-1] - taken[0]) < CHECKED_S:
            return
        rate_hz = (len(taken) - 1) / span_s
        taken.clear()
        if rate_hz < SLOW * self._wanted_hz and time_s - self._reported_s > 10 * CHECKED_S:
            self._reported_s = time_s
            wanted = f"expected {self._wanted_hz:g} frames/s"
            what = f"camera {self._device}: {wanted}, found {rate_hz:.0f}"
            yield Trouble("video", time_s, f"{what}; more light or another mode may help")


class Microphone(DeviceSource):
    """Sound of a microphone as it comes.

    Parameters
    ----------
    device
        ``default``, or a number or part of the name as PortAudio lists them.
    rate_hz
        Sample rate.
    n_channels
        Channels wanted: one is the last of the microphone's two, as when recording, or its only
        one.
    source
        Another microphone than PortAudio's.

    Raises
    ------
    InputError
        If PortAudio is missing, or there is no such microphone, or not of that rate.
    """

    channel: Channel = "audio"

    def __init__(
        self,
        device: str,
        rate_hz: float,
        n_channels: int = 1,
        source: devices.Microphone | None = None,
    ) -> None:
        """Open it."""
        self.rate_hz, self._n_channels = rate_hz, n_channels

        def choose(channels: int) -> devices.Microphone:
            settings = {"device": device, "rate_hz": rate_hz, "channels": channels}
            settings |= {"kind": "portaudio"}
            return devices.make_device(devices.MICROPHONES, settings, f"microphone {device}")

        self._source = source or choose(max(n_channels, 2))
        try:
            super().__init__(self._source)
        except InputError:
            if source is not None or n_channels > 1:
                raise
            self._source = choose(1)  # it may have no second
            super().__init__(self._source)

    def _take(self) -> Iterator[Event]:
        count = devices.SampleClock(self.rate_hz)
        for block in self._source.blocks():
            if block.overflowed:
                yield Trouble("audio", count.next_s, "microphone: overrun, samples are lost")
            yield make_sound(block, block.samples[:, -self._n_channels :], count)


def make_sound(
    block: devices.Block, samples: NDArray[np.int16], count: devices.SampleClock
) -> Sound:
    """Return the sound of some channels of a block, timed by the count of samples."""
    time_s = count.read(len(samples), block.time_s, block.overflowed)
    return Sound(time_s, samples.astype(np.float32) / FULL_SCALE, time.monotonic())

"""A running tactile fingertip as a camera of LeRobot."""

import time
from threading import Event, Thread
from typing import Any

import cv2
from lerobot.cameras import Camera
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from afferents.errors import InputError
from afferents.lab.devices import find_devices
from afferents.lab.live import LivePipeline, Source, Wanted, find_sensor, open_sources
from afferents.lab.live.events import Mailbox
from afferents.lab.live.touch import Filled, Pixels, colour_image
from afferents.lab.live.web.snapshot import ring_px
from afferents.markers.sensor import load_sensor
from afferents.recordings.check import RATE_TOLERANCE
from afferents.store.recording import Frame
from lerobot_camera_afferents.config_camera import SHOWS, AfferentsCameraConfig
from lerobot_camera_afferents.signed import draw_signed

PATIENCE_MS = 60_000
"""An image may take so long, as the rig's first: it records before it plays."""
LET_GO_S = 2.0
"""A source is given so long to let go of its device."""
AMBER = (255, 176, 0)


class AfferentsCamera(Camera):
    """Gives what a tactile fingertip sees or senses as images, (height, width, 3), uint8, RGB.

    A thread follows the source; images wait for nobody, the newest is given.

    Parameters
    ----------
    config
        Which source, and what of it.
    """

    def __init__(self, config: AfferentsCameraConfig) -> None:
        """Touch nothing yet."""
        super().__init__(config)
        self.config = config
        self._source: Source | None = None
        self._thread: Thread | None = None
        self._newest: tuple[Pixels, float] | None = None
        self._is_new = Event()
        self._over: str | None = None
        self._trouble = ""

    def __str__(self) -> str:
        """Return what is shown of which source."""
        return f"{self.config.shows} of {self.config.source}"

    @property
    def is_connected(self) -> bool:
        """Whether the source is open."""
        return self._source is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return what is plugged in (on Linux); ``id`` is a `source`."""
        return [
            {"name": one.name, "type": "afferents", "id": f"camera:{one.device}"}
            for one in find_devices().cameras
        ]

    @check_if_already_connected
    def connect(self, warmup: bool = True) -> None:
        """Open the source.

        Parameters
        ----------
        warmup
            Wait for the first image; of markers and responses it comes once the skin was seen at
            rest.

        Raises
        ------
        ConnectionError
            If there is no such source or sensor, or it can't be had so.
        TimeoutError
            If no image came.
        """
        config = self.config
        try:
            sensor = find_sensor(
                config.source, load_sensor(config.sensor) if config.sensor else None
            )
            wanted = Wanted(sensor=sensor, fps_hz=config.fps)
            (source,) = open_sources(config.source, None, wanted)
        except InputError as error:
            raise ConnectionError(str(error).replace("--video: ", "source: ")) from error
        if config.fps and abs(config.fps / source.rate_hz - 1) > RATE_TOLERANCE:
            source.close()
            has = f"{source.rate_hz:.0f}, as {config.source} has"
            raise ConnectionError(f"fps: expected {has}, found {config.fps}; give that one")
        self.fps = config.fps or round(source.rate_hz)
        self._source, self._newest, self._over, self._trouble = source, None, None, ""
        self._is_new.clear()
        pipeline = LivePipeline.without_models([source], sensor)
        self._thread = Thread(target=self._follow, args=(source, pipeline), daemon=True)
        self._thread.start()
        if warmup:
            try:
                self.async_read(PATIENCE_MS)
            except BaseException:
                self.disconnect()
                raise

    @check_if_not_connected
    def disconnect(self) -> None:
        """Let go of the source."""
        source, self._source = self._source, None
        source.close()
        self._thread.join()

    def read(self) -> Pixels:
        """Return the next image; see `async_read`."""
        self._is_new.clear()
        return self.async_read(PATIENCE_MS)

    @check_if_not_connected
    def async_read(self, timeout_ms: float = 200) -> Pixels:
        """Return the newest image that was not read yet; wait for it where need be.

        Raises
        ------
        TimeoutError
            If none came in time.
        RuntimeError
            If none will come: the clip has ended, or the source failed.
        """
        if self._over is None and not self._is_new.wait(timeout_ms / 1000):
            why = f": {self._trouble}" if self._trouble else ""
            raise TimeoutError(f"{self}: expected an image in {timeout_ms:g} ms, found none{why}")
        self._is_new.clear()
        return self._last()[0]

    @check_if_not_connected
    def read_latest(self, max_age_ms: int = 500) -> Pixels:
        """Return the newest image, read or not, without waiting.

        Raises
        ------
        TimeoutError
            If it is older than `max_age_ms`.
        RuntimeError
            If there is none yet, or none will come any more.
        """
        image, drawn_s = self._last()
        if (age_ms := 1000 * (time.perf_counter() - drawn_s)) > max_age_ms:
            expected = f"expected an image of the last {max_age_ms} ms"
            raise TimeoutError(f"{self}: {expected}, found one of {age_ms:.0f} ms ago")
        return image

    def _last(self) -> tuple[Pixels, float]:
        if self._over is not None:
            raise RuntimeError(f"{self}: {self._over}")
        if self._newest is None:
            raise RuntimeError(f"{self}: no image yet; 'connect' waits for the first")
        return self._newest

    def _follow(self, source: Source, pipeline: LivePipeline) -> None:
        """Take what the source gives until it ends, or is let go."""
        mailbox = Mailbox()
        mailbox.take_from(source)
        until_s = float("inf")
        try:
            for event in mailbox.take(0.1):
                if self._source is not source:
                    until_s = min(until_s, time.monotonic() + LET_GO_S)
                elif event is not None:
                    self._take(event, pipeline)
                if time.monotonic() >= until_s:
                    break
            else:
                self._over = "it has ended; disconnect, and connect again to begin anew"
        except Exception as error:  # noqa: BLE001  said where images are read
            self._over = str(error)
        self._is_new.set()

    def _take(self, event: Any, pipeline: LivePipeline) -> None:
        for prediction in pipeline.feed(event):
            self._trouble = "; ".join(prediction.troubles) or self._trouble
        video = pipeline.video
        if video.picture is event and (image := self._draw(event.frame, video.newest)) is not None:
            self.height, self.width = image.shape[:2]
            self._newest, self._trouble = (image, time.perf_counter()), ""
            self._is_new.set()

    def _draw(self, frame: Frame, found: Filled | None) -> Pixels | None:
        """Return what is shown of a frame; None where there is nothing to show yet."""
        config, grey = self.config, frame.image
        size = config.width or grey.shape[1], config.height or grey.shape[0]
        if config.shows != "picture" and found is None:
            return None
        if usual_px := SHOWS[config.shows]:
            most_px = config.most_px or usual_px
            if config.shows == "signed":
                image = draw_signed(found.touch, most_px)
            elif (response := found.image(config.shows)) is not None:
                image = colour_image(response, most_px)
            else:
                return None
            return cv2.resize(image, size, interpolation=cv2.INTER_NEAREST)
        image = cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB)
        if config.shows == "markers":
            at = found.touch.seen[found.touch.detected]
            radius = round(ring_px(at))
            for centre in at.round().astype(int).tolist():
                cv2.circle(image, centre, radius, AMBER)
        return cv2.resize(image, size, interpolation=cv2.INTER_AREA)

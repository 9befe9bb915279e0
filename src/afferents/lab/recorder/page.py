"""What the page shows of a recording: camera with markers, sound, and what to do next."""

from contextlib import suppress
from typing import Any

import cv2
from pydantic_core import to_json

from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.lab.devices import base, clock
from afferents.lab.devices.picture import Picture, decode_picture
from afferents.lab.live import events, sensors, streams
from afferents.lab.live.follower import Follower
from afferents.lab.live.touch import SHOWN, Filled, Filling, require_places
from afferents.lab.live.web.snapshot import Shown, draw_markers, draw_spectrum
from afferents.lab.recorder.watch import Watch
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame


class RecordingPage(Shown):
    """Draws up what a `Watch` has, when a visitor looks.

    Parameters
    ----------
    watch
        Written by the recorder's threads.
    sensor
        Says where the markers are.
    """

    fresh_s = 0.1

    def __init__(self, watch: Watch, sensor: Sensor) -> None:
        """Nothing is seen yet."""
        self._watch = watch
        require_places(sensor)
        self._sensor = sensor.model_copy(update={"rest_frame": 0})
        self._series = -1
        self._begin(1.0)  # the rate comes with the camera

    def hello(self) -> dict[str, Any]:
        """Return what does not change: no model runs, this is a recording."""
        return {"type": "hello", "models": [], "recording": True}

    def draw(self) -> tuple[str, bytes | None]:
        """Draw up the state as JSON, and the picture."""
        pair, first, camera = self._watch.newest, self._watch.first, self._watch.camera
        jpeg: bytes | None = None
        video: dict[str, Any] | None = None
        if pair and camera is not None:  # else nothing is seen yet
            if self._series != self._watch.series and first is not None:
                self._series = self._watch.series
                self._begin(camera.fps_hz)
                self._follow(first, camera)
            *_, picture = [self._follow(taken, camera) for taken in pair]
            if camera.format == "MJPG":
                jpeg = pair[-1].data
            elif picture is not None:
                jpeg = bytes(cv2.imencode(".jpg", Frame(0.0, *picture).image)[1])
        if camera is not None:
            video = {"rate_hz": camera.fps_hz, "sensor": self._follower.describe(), "quality": []}
            if pair and self._touched is not None:
                video |= {"size": (camera.width, camera.height), **draw_markers(self._touched)}
        state: dict[str, Any] = {
            "type": "state",
            "ended": None,
            "predictions": [],
            "video": video,
            "audio": self._hear(),
            "recording": self._watch.state(),
        }
        return to_json(state, inf_nan_mode="null").decode(), jpeg  # a speed may be unknown

    def _begin(self, fps_hz: float) -> None:
        """Wait for the first frame of a series, which shows the skin at rest."""
        self._follower, self._filling = Follower(self._sensor, fps_hz, is_known=True), Filling()
        self._touched: Filled | None = None
        self._audio: streams.AudioStream | None = None

    def _follow(self, taken: base.Frame, camera: base.CameraSettings) -> Picture | None:
        """Follow the markers of a frame; return its picture."""
        picture = decode_picture(taken.data, camera)
        if picture is not None:
            frame = events.CameraFrame(Frame(taken.time_s, *picture), 0.0)
            with suppress(InputError):  # no markers: the picture itself shows why
                for _, touch in self._follower.feed(frame) or self._follower.finish():
                    self._touched = Filled(touch, self._filling.feed(touch, SHOWN))
        return picture

    def _hear(self) -> dict[str, Any] | None:
        microphone = self._watch.microphone
        if microphone is None:
            return None
        if self._audio is None:
            self._audio = streams.AudioStream(SpectralEncoding(), microphone.rate_hz)
            self._count = clock.SampleClock(microphone.rate_hz)
        while self._watch.blocks:
            block = self._watch.blocks.popleft()
            samples = block.samples[:, [self._watch.sensor_channel]]
            for _ in self._audio.feed(sensors.make_sound(block, samples, self._count)):
                pass
        return {"rate_hz": microphone.rate_hz, "quality": [], **draw_spectrum(self._audio)}

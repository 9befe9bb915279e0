"""What the page shows of a recording: camera with markers, sound, and what is to be done."""

from contextlib import suppress
from typing import Any

import cv2
from pydantic_core import to_json

from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.lab.devices.base import CameraSettings
from afferents.lab.devices.base import Frame as Taken
from afferents.lab.devices.clock import SampleClock
from afferents.lab.devices.picture import picture_of
from afferents.lab.live.audio_stream import AudioStream
from afferents.lab.live.events import CameraFrame
from afferents.lab.live.follower import Follower
from afferents.lab.live.sensors import make_sound
from afferents.lab.live.touch import SHOWN, Filled, Filling, require_places
from afferents.lab.live.web.snapshot import Shown, draw_markers, draw_spectrum
from afferents.lab.recorder.watch import Watch
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame


class RecordingPage(Shown):
    """Draws up what a `Watch` has, when a visitor asks.

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
        pair = self._watch.newest
        felt, jpeg = self._seen(pair)
        said: dict[str, Any] = {
            "type": "state",
            "ended": None,
            "predictions": [],
            "video": self._video(felt),
            "audio": self._heard(),
            "recording": self._watch.state(),
        }
        return to_json(said, inf_nan_mode="null").decode(), jpeg  # of a speed that nobody reads

    def _seen(self, pair: tuple[Taken, ...]) -> tuple[Filled | None, bytes | None]:
        """Follow the markers of the newest two frames, from the first of the series on."""
        first, camera = self._watch.first, self._watch.camera
        if not pair or camera is None:
            return None, None
        if self._series != self._watch.series and first is not None:
            self._series = self._watch.series
            self._begin(camera.fps_hz)
            self._feed(first, camera)
        for taken in pair:
            self._feed(taken, camera)
        return self._felt, _jpeg(pair[-1], camera)

    def _begin(self, fps_hz: float) -> None:
        """Wait for the first frame of a series, which shows the skin at rest."""
        self._follower, self._filling = Follower(self._sensor, fps_hz, is_known=True), Filling()
        self._felt: Filled | None = None
        self._audio: AudioStream | None = None

    def _feed(self, taken: Taken, camera: CameraSettings) -> None:
        picture = picture_of(taken.data, camera)
        if picture is None:
            return
        frame = CameraFrame(Frame(taken.time_s, *picture), 0.0)
        with suppress(InputError):  # no markers: the picture itself shows why
            for _, touch in self._follower.feed(frame) or self._follower.finish():
                self._felt = Filled(touch, self._filling.feed(touch, SHOWN))

    def _video(self, felt: Filled | None) -> dict[str, Any] | None:
        camera = self._watch.camera
        if camera is None:
            return None
        content: dict[str, Any] = {
            "rate_hz": camera.fps_hz,
            "sensor": self._follower.describe(),
            "quality": [],
        }
        if felt is not None:
            content |= {"size": (camera.width, camera.height), **draw_markers(felt)}
        return content

    def _heard(self) -> dict[str, Any] | None:
        microphone = self._watch.microphone
        if microphone is None:
            return None
        if self._audio is None:
            self._audio = AudioStream(SpectralEncoding(), microphone.rate_hz)
            self._count = SampleClock(microphone.rate_hz)
        while self._watch.blocks:
            block = self._watch.blocks.popleft()
            samples = block.samples[:, [self._watch.sensor_channel]]
            for _ in self._audio.feed(make_sound(block, samples, self._count)):
                pass
        return {"rate_hz": microphone.rate_hz, "quality": [], **draw_spectrum(self._audio)}


def _jpeg(taken: Taken, camera: CameraSettings) -> bytes | None:
    if camera.format == "MJPG":
        return taken.data
    picture = picture_of(taken.data, camera)
    if picture is None:
        return None
    return bytes(cv2.imencode(".jpg", Frame(0.0, *picture).image)[1])

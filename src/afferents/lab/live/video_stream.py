"""A camera's stream: from frames to predictions, by SA-I and RA-I."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Self

from afferents.documents import as_form
from afferents.errors import InputError
from afferents.lab.live.events import Begin, CameraFrame, Event, Trouble
from afferents.lab.live.follower import MISSING, Follower
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.quality import VideoQuality
from afferents.lab.live.reporters import ModelReporter
from afferents.lab.live.sensor_stream import SensorStream, require_alike
from afferents.lab.live.touch import SHOWN, Filled, Filling, Touch, require_places
from afferents.markers.sensor import Sensor

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import Lessons

SLOW = 1.12
"""Frames in a row that are farther apart than this, on average, make RA-I too large."""


class VideoStream(SensorStream):
    """A sensor's camera: what models recognise by it, or what it shows.

    Parameters
    ----------
    sensor
        Whose markers are followed; None to find them at rest, as `calibrate` does.
    rate_hz
        Frames a second.
    networks
        Models of this sensor; none to show it only.

    Attributes
    ----------
    follower
        Of the markers.
    picture, newest
        The last frame, and its touch; None before there is one.

    Raises
    ------
    InputError
        If the sensor file does not give the places of the markers.
    """

    quality: VideoQuality

    def __init__(
        self, sensor: Sensor | None, rate_hz: float, networks: Sequence[Network] = ()
    ) -> None:
        """Wait for the rest frame."""
        if sensor is not None:
            require_places(sensor)
        super().__init__("video", rate_hz, networks, VideoQuality(rate_hz))
        self.follower = Follower(sensor, rate_hz, is_known=bool(networks))
        self.follower.counters = self.counters
        self.picture: CameraFrame | None = None
        self.newest: Filled | None = None
        self._channels = {network.channel for network in networks}
        self._more = [channel for channel in SHOWN if channel not in self._channels]
        self._filling, self._step = Filling(), 1.0
        self._longest = SLOW if networks else math.inf  # without models slow pictures are shown
        self.lessons: Lessons | None = None

    @classmethod
    def of(cls, networks: Sequence[Network]) -> Self:
        """Return the stream by which one or more models classify.

        Raises
        ------
        InputError
            If they learnt from different sensors or frame rates.
        """
        card = networks[0].card
        require_alike(networks, ("sensor", "fps_hz"), "sensor and frame rate")
        assert card.fps_hz is not None
        assert card.sensor is not None
        wanted, do = "a card with a sensor file of this version", "train the model again"
        return cls(
            as_form(card.sensor, Sensor, networks[0].path, wanted, do), card.fps_hz, networks
        )

    def learn(self, lessons: "Lessons") -> None:
        """Let textures be taught from now on, and report what is recognised of them."""
        self.lessons = lessons
        self._channels.add(lessons.network.channel)
        lessons.reporter = ModelReporter(lessons.network, self.counters, self.quality)
        models = [one for one in self.reporters if isinstance(one, ModelReporter)]
        self.reporters = [*models, lessons.reporter]

    def begin(self, event: Begin) -> None:
        """Wait for the rest frame of another recording."""
        if self.lessons is not None:
            self.lessons.end()
        self.follower.begin()
        self.newest = None
        self._filling, self._step = Filling(), 1.0  # of frames in a row, in periods, over a second
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next one, whose touch shows that to all."""
        self.follower.skip()

    def feed(self, event: Event) -> Iterator[Prediction]:
        """Take in a frame; see `SensorStream.feed`."""
        assert isinstance(event, CameraFrame)
        if event.time_s < self.now_s - (1 + MISSING) / self.rate_hz:
            self.put_clock_back()
        self.now_s = event.time_s + 1 / self.rate_hz
        late = self.is_late(event.time_s, event.arrived_s)
        try:
            touches = self.follower.feed(event, late)
        except InputError as error:
            yield from self.interrupt(Trouble("video", event.time_s, str(error)), "waiting")
            touches = []
        if touches is None:
            return
        self.newest = None
        for picture, touch in touches:
            yield from self._report(picture, touch)
        self.picture = event
        self.quality.add(event, self.newest, self.follower.sensor)

    def end(self) -> Iterator[Prediction]:
        """Report what the first frames show, even if few; see `SensorStream.end`."""
        try:
            touches = self.follower.finish()
        except InputError as error:
            yield from self.interrupt(Trouble("video", self.now_s, str(error)), "waiting")
            return
        for picture, touch in touches:
            yield from self._report(picture, touch)
        if self.lessons is not None and self.lessons.state()["name"] is not None:
            self.lessons.end()
            yield from self.report_nothing("waiting")  # with what was learnt

    def _report(self, picture: CameraFrame, touch: Touch) -> Iterator[Prediction]:
        """Yield what is predicted by a frame, and only then prepare what is drawn."""
        if touch.before is not None:
            self._step += (touch.step_s * self.rate_hz - self._step) / self.rate_hz
        is_late = touch.late or self._step > self._longest
        self.now_s = touch.time_s + 1 / self.rate_hz
        filled = Filled(touch, self._filling.feed(touch, self._channels))
        for reporter in self.reporters:
            if touch.events:
                reporter.note(*touch.events)
            found = reporter.report_touch(
                filled, self.now_s, self.every_s, picture.arrived_s, is_late
            )
            if found is not None:
                yield found
        if self.lessons is not None and self.follower.sensor is not None:
            self.lessons.take(picture, filled, self.follower.sensor)
        more = self._filling.feed(touch, self._more)
        self.newest = Filled(touch, {**filled.markers, **more})
        self.raster.take(touch.time_s, self.newest)

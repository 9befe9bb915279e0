"""Streams of a camera and of a microphone: from what comes in to predictions."""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from afferents.documents import as_form
from afferents.encodings import base, spectra
from afferents.errors import InputError
from afferents.lab.devices.clock import HostClock
from afferents.lab.live import events, follower, raster, reporters
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Counters, Prediction, State
from afferents.lab.live.quality import AudioQuality, Quality, VideoQuality
from afferents.lab.live.touch import SHOWN, Filled, Filling, Touch, require_places
from afferents.markers.sensor import Sensor

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import Lessons

LATE_S = 0.1
"""What lags more than this behind the quickest arrival shows the past."""
JUMP_S = 0.002
"""Sound whose time is off by more than this from the samples' count has lost some."""
SILENT_S = 0.5
"""A source that gives nothing for this time is stalled; no wait for a message is longer."""
START_S = 3.0
"""A source may take this time for its first event: cameras start slowly, and so does the rig."""
_FORGET = 0.001
"""The quickest arrival seen grows by this share of the time since then, as clocks drift."""
NAMES: dict[events.Channel, str] = {"video": "camera", "audio": "microphone"}
"""Names in predictions where there is no model."""
SLOW = 1.12
"""Frames in a row that are farther apart than this, on average, make RA-I too large."""


class SensorStream(ABC):
    """A camera or a microphone, and the models that classify by it; without any, it is looked at.

    Parameters
    ----------
    channel
        Which.
    rate_hz
        Frames or samples a second that models learnt from, or that the source gives.
    networks
        The models, if any.
    quality
        Figures of what comes in.

    Attributes
    ----------
    raster
        Which units fired in the last second; none before `LivePipeline.show_spikes`.
    speed
        Of the source; see `Source`.
    reported_s
        When a prediction was last taken, on the monotonic clock, s.
    lessons
        What is taught by it; None where nothing is.
    """

    def __init__(
        self, channel: events.Channel, rate_hz: float, networks: Sequence[Network], quality: Quality
    ) -> None:
        """Begin with nothing."""
        self.channel = channel
        self.rate_hz = rate_hz
        self.every_s = 1 / rate_hz
        self.counters = Counters()
        self.quality = quality
        models = [reporters.ModelReporter(network, self.counters, quality) for network in networks]
        without = reporters.Reporter(NAMES[channel], self.counters, quality)
        self.reporters: Sequence[reporters.Reporter] = models or [without]
        self.now_s = 0.0
        self.raster = raster.Raster()
        self.lessons: Lessons | None = None
        self._clock = HostClock(_FORGET)
        self.start(1.0)

    def start(self, speed: float) -> None:
        """Count silence from now: a source of that speed begins."""
        self.speed = speed
        self._started_s = self.reported_s = time.monotonic()
        self._named_s = -math.inf  # with what the silence began that was reported last

    @abstractmethod
    def feed(self, event: events.Event) -> Iterator[Prediction]:
        """Take in an event; yield what is predicted, and only then measure how good it all is.

        A caller that stops early leaves the latter out.
        """

    @abstractmethod
    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""

    def begin(self, event: events.Begin) -> None:
        """Forget all but the counters: another recording begins."""
        self.now_s = event.time_s
        self.put_clock_back()
        self.raster.begin()
        for reporter in self.reporters:
            reporter.begin()
            reporter.truth = event.truth

    def end(self) -> Iterator[Prediction]:
        """Yield what is still to be predicted: nothing more comes of this recording."""
        return iter(())

    def put_clock_back(self) -> None:
        """Forget what later times showed of the source's clock: it goes on from an earlier one."""
        self._clock = HostClock(_FORGET)
        self.quality.begin()

    def interrupt(self, trouble: events.Trouble, state: State = "stalled") -> list[Prediction]:
        """Report what went wrong, and that nothing fresh is known."""
        self.counters.troubles += 1
        self.skip()
        self.raster.begin()
        for reporter in self.reporters:
            reporter.note(trouble.what)
        return self.report_nothing(state)

    def report_nothing(self, state: State) -> list[Prediction]:
        """Let all models report that nothing fresh is known."""
        return [reporter.predict(state, self.now_s) for reporter in self.reporters]

    def break_silence(self, last_s: float | None) -> list[Prediction]:
        """Return a report where there was none for long, so that nothing old passes as fresh.

        Parameters
        ----------
        last_s
            When the source last gave something, whether it was taken already or not.
        """
        now_s = time.monotonic()
        if now_s - self.reported_s < max(SILENT_S, 2 * self.every_s):
            return []
        self.reported_s = now_s
        since_s = self._started_s if last_s is None else last_s
        silent_s = now_s - since_s
        if silent_s < (START_S if last_s is None else SILENT_S):
            return self.report_nothing("waiting")
        if since_s == self._named_s:  # one silence is one trouble, however long
            return self.report_nothing("stalled")
        self._named_s = since_s
        what = f"{self.channel}: nothing for {silent_s:.1f} s"
        self.quality.begin()
        return self.interrupt(events.Trouble(self.channel, self.now_s, what))

    def is_late(self, time_s: float, arrived_s: float) -> bool:
        """Return whether what was taken at `time_s` came too late to show the present; count it."""
        if math.isinf(self.speed):
            return False
        late = time.monotonic() - arrived_s > LATE_S  # it has waited here
        if not late:
            late = arrived_s - self._clock.read(time_s / self.speed, arrived_s) > LATE_S
        self.counters.late += late
        return late


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
        self.follower = follower.Follower(sensor, rate_hz, is_known=bool(networks))
        self.follower.counters = self.counters
        self.picture: events.CameraFrame | None = None
        self.newest: Filled | None = None
        self._channels = {network.channel for network in networks}
        self._more = [channel for channel in SHOWN if channel not in self._channels]
        self._filling, self._step = Filling(), 1.0
        self._longest = SLOW if networks else math.inf  # without models slow pictures are shown

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
        lessons.reporter = reporters.ModelReporter(lessons.network, self.counters, self.quality)
        models = [one for one in self.reporters if isinstance(one, reporters.ModelReporter)]
        self.reporters = [*models, lessons.reporter]

    def begin(self, event: events.Begin) -> None:
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

    def feed(self, event: events.Event) -> Iterator[Prediction]:
        """Take in a frame; see `SensorStream.feed`."""
        assert isinstance(event, events.CameraFrame)
        if event.time_s < self.now_s - (1 + follower.MISSING) / self.rate_hz:
            self.put_clock_back()
        self.now_s = event.time_s + 1 / self.rate_hz
        late = self.is_late(event.time_s, event.arrived_s)
        try:
            touches = self.follower.feed(event, late)
        except InputError as error:
            yield from self.interrupt(events.Trouble("video", event.time_s, str(error)), "waiting")
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
            yield from self.interrupt(events.Trouble("video", self.now_s, str(error)), "waiting")
            return
        for picture, touch in touches:
            yield from self._report(picture, touch)
        if self.lessons is not None and self.lessons.state()["name"] is not None:
            self.lessons.end()
            yield from self.report_nothing("waiting")  # with what was learnt

    def _report(self, picture: events.CameraFrame, touch: Touch) -> Iterator[Prediction]:
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


class AudioStream(SensorStream):
    """A microphone, or other vibration channels: what models recognise by it, or what it gives.

    Parameters
    ----------
    encoding
        What samples are made by.
    rate_hz, n_channels
        Of the vibration.
    offset_s
        The microphone's clock is ahead of the camera's by this much, s.
    networks
        Models that take such samples; none to show it only.

    Attributes
    ----------
    newest
        The last sample; None before there is one.
    """

    quality: AudioQuality

    def __init__(
        self,
        encoding: base.VibrationEncoding,
        rate_hz: float,
        n_channels: int = 1,
        offset_s: float = 0.0,
        networks: Sequence[Network] = (),
    ) -> None:
        """Wait for the first window to fill."""
        super().__init__("audio", rate_hz, networks, AudioQuality(rate_hz))
        self.encoding = encoding
        self.every_s = float(getattr(encoding, "stride_s", 1.0))
        self.n_channels = n_channels
        self.offset_s = offset_s
        self.newest: base.Ready | None = None
        self._samples: base.VibrationStream = encoding.stream(rate_hz, n_channels)
        self._next_s: float | None = None

    @classmethod
    def of(cls, networks: Sequence[Network], offset_s: float = 0.0) -> Self:
        """Return the stream by which one or more models classify.

        Raises
        ------
        InputError
            If they learnt from different rates or spectra.
        """
        first, card = networks[0], networks[0].card
        require_alike(networks, ("sample_rate_hz", "encoding", "shape"), "sample rate and spectra")
        assert isinstance(first.encoding, base.VibrationEncoding)  # as `of_vibration` states
        assert card.sample_rate_hz is not None
        return cls(first.encoding, card.sample_rate_hz, card.shape[0], offset_s, networks)

    def begin(self, event: events.Begin) -> None:
        """Wait for the first window of another recording."""
        self._samples.skip()
        self.newest = self._next_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: samples are missing before the next one."""
        self._samples.skip()
        self.raster.skip()

    def feed(self, event: events.Event) -> Iterator[Prediction]:
        """Take in some samples; see `SensorStream.feed`."""
        assert isinstance(event, events.Sound)
        time_s, samples = event.time_s - self.offset_s, event.samples
        self.counters.samples += len(samples)
        if self._next_s is not None and abs(gap_s := time_s - self._next_s) > JUMP_S:
            self.counters.lost_samples += max(0, round(gap_s * self.rate_hz))
            self.skip()
            if gap_s < 0:
                self.put_clock_back()
        self.now_s = self._next_s = time_s + len(samples) / self.rate_hz
        late = self.is_late(self.now_s, event.arrived_s)
        ready = self._samples.feed(time_s, samples)
        if ready:
            self.newest = ready[-1]
        if ready and late:
            yield from self.report_nothing("stalled")
        else:
            for sample in ready:
                for reporter in self.reporters:
                    found = reporter.report(
                        sample.values, sample.end_s, self.every_s, event.arrived_s
                    )
                    if found is not None:
                        yield found
        if self.lessons is not None:
            self.lessons.hear(time_s, samples)
        self.quality.add(event)
        self.raster.take(time_s, samples)

    def spectrum(self) -> tuple[NDArray[np.float32], float] | None:
        """Return the newest sample's amplitudes, mean over channels, and their distance, Hz.

        None before there is one, or where samples are no spectra.
        """
        encoding, newest = self.encoding, self.newest
        if newest is None or not isinstance(encoding, spectra.SpectralEncoding):
            return None
        points = encoding.fft_points or encoding.window_s * self.rate_hz
        return newest.values.mean(axis=0), self.rate_hz / points


def require_alike(networks: Sequence[Network], fields: Sequence[str], what: str) -> None:
    """Refuse models whose cards differ in some fields.

    Raises
    ------
    InputError
        Naming the first that differs from the first of all.
    """
    first, *others = networks
    for other in others:
        if any(getattr(other.card, name) != getattr(first.card, name) for name in fields):
            raise InputError(f"{other.path}: expected the {what} of {first.path}, found others")

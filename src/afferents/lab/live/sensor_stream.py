"""A sensor stream: what a camera and a microphone have in common on the way to predictions."""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

from afferents.errors import InputError
from afferents.lab.devices.clock import HostClock
from afferents.lab.live.events import Begin, Channel, Event, Trouble
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Counters, Prediction, State
from afferents.lab.live.quality import Quality
from afferents.lab.live.raster import Raster
from afferents.lab.live.reporters import ModelReporter, Reporter

LATE_S = 0.1
"""What lags more than this behind the quickest arrival shows the past."""
JUMP_S = 0.002
"""Sound whose time is off by more than this from the samples' count has lost some."""
SILENT_S = 0.5
"""A source that gives nothing for this time is stalled; no wait for a message is longer."""
START_S = 3.0
"""A source may take this time for its first event: cameras start slowly, and so does the rig."""
_FORGET = 0.001
"""The quickest arrival is forgotten by this share of the time gone by: clocks drift."""
NAMES: dict[Channel, str] = {"video": "camera", "audio": "microphone"}
"""That predictions carry where a model's would be."""


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
    """

    def __init__(
        self, channel: Channel, rate_hz: float, networks: Sequence[Network], quality: Quality
    ) -> None:
        """Begin with nothing."""
        self.channel = channel
        self.rate_hz = rate_hz
        self.every_s = 1 / rate_hz
        self.counters = Counters()
        self.quality = quality
        models = [ModelReporter(network, self.counters, quality) for network in networks]
        without = Reporter(NAMES[channel], self.counters, quality)
        self.reporters: Sequence[Reporter] = models or [without]
        self.now_s = 0.0
        self.raster = Raster()
        self._clock = HostClock(_FORGET)
        self.start(1.0)

    def start(self, speed: float) -> None:
        """Count silence from now: a source of that speed begins."""
        self.speed = speed
        self._started_s = self.reported_s = time.monotonic()
        self._named_s = -math.inf  # with what the silence began that was reported last

    @abstractmethod
    def feed(self, event: Event) -> Iterator[Prediction]:
        """Take in an event; yield what is predicted, and only then measure how good it all is.

        A caller that stops early leaves the latter out.
        """

    @abstractmethod
    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""

    def begin(self, event: Begin) -> None:
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

    def interrupt(self, trouble: Trouble, state: State = "stalled") -> list[Prediction]:
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
        return self.interrupt(Trouble(self.channel, self.now_s, what))

    def is_late(self, time_s: float, arrived_s: float) -> bool:
        """Return whether what was taken at `time_s` came too late to show the present; count it."""
        if math.isinf(self.speed):
            return False
        late = time.monotonic() - arrived_s > LATE_S  # it has waited here
        if not late:
            late = arrived_s - self._clock.read(time_s / self.speed, arrived_s) > LATE_S
        self.counters.late += late
        return late


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

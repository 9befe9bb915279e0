"""A microphone's stream: from vibration to predictions, by RA-II."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from afferents.encodings.base import Ready, VibrationEncoding, VibrationStream
from afferents.encodings.spectra import SpectralEncoding
from afferents.lab.live.events import Begin, Event, Sound
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.quality import AudioQuality
from afferents.lab.live.sensor_stream import JUMP_S, SensorStream, require_alike

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import Lessons


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
        encoding: VibrationEncoding,
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
        self.lessons: Lessons | None = None
        self.newest: Ready | None = None
        self._samples: VibrationStream = encoding.stream(rate_hz, n_channels)
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
        assert isinstance(first.encoding, VibrationEncoding)  # as `of_vibration` states
        assert card.sample_rate_hz is not None
        return cls(first.encoding, card.sample_rate_hz, card.shape[0], offset_s, networks)

    def begin(self, event: Begin) -> None:
        """Wait for the first window of another recording."""
        self._samples.skip()
        self.newest = self._next_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: samples are missing before the next one."""
        self._samples.skip()
        self.raster.skip()

    def feed(self, event: Event) -> Iterator[Prediction]:
        """Take in some samples; see `SensorStream.feed`."""
        assert isinstance(event, Sound)
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
        if newest is None or not isinstance(encoding, SpectralEncoding):
            return None
        points = encoding.fft_points or encoding.window_s * self.rate_hz
        return newest.values.mean(axis=0), self.rate_hz / points

"""From frames and vibration to percepts: what both senses share, and each of them."""

import math
import time
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from afferents.encodings.base import Ready, VibrationEncoding
from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.live.events import Begin, CameraFrame, Channel, Sound, Trouble
from afferents.live.images import SHOWN, FrameByFrame, FrameImages, Images
from afferents.live.network import Network
from afferents.live.percept import Counters, Percept, State
from afferents.live.quality import AudioQuality, Quality, VideoQuality
from afferents.live.raster import MarkerRaster, Raster, VibrationRaster
from afferents.live.session import LookSession, ModelSession, PredictionSession
from afferents.markers.sensor import Sensor

LATE_S = 0.1
"""What lags more than this behind the quickest arrival tells of the past."""
_FORGET = 0.001
"""The quickest arrival is forgotten by this share of the time gone by: clocks drift."""


class Sense:
    """The models that feel by one channel; without any, it is looked at.

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
        Which units fired in the last second; None where nobody asked, see `Senses.show_spikes`.
    """

    raster: Raster | None = None

    def __init__(
        self, channel: Channel, rate_hz: float, networks: Sequence[Network], quality: Quality
    ) -> None:
        """Begin with nothing."""
        self.channel = channel
        self.rate_hz = rate_hz
        self.every_s = 1 / rate_hz
        self.counters = Counters()
        self.quality = quality
        feeling = [ModelSession(network, self.counters, quality) for network in networks]
        self.sessions: Sequence[PredictionSession] = feeling or [
            LookSession(channel, self.counters, quality)
        ]
        self.now_s = 0.0
        self.speed = 1.0
        self._quickest: tuple[float, float] | None = None

    def begin(self, event: Begin) -> None:
        """Forget all but the counters: another recording begins."""
        self.now_s, self._quickest = event.time_s, None
        self.quality.begin()
        if self.raster is not None:
            self.raster.begin()
        for session in self.sessions:
            session.begin()
            session.truth = event.truth

    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""
        for session in self.sessions:
            session.skip()

    def interrupt(self, trouble: Trouble, state: State = "stalled") -> list[Percept]:
        """Say what went wrong, and that nothing fresh is known."""
        self.counters.troubles += 1
        self.skip()
        if self.raster is not None:
            self.raster.begin()
        for session in self.sessions:
            session.interrupt(trouble.what)
        return self.without(state)

    def without(self, state: State) -> list[Percept]:
        """Let all models say that nothing fresh is known."""
        return [session.without(state, self.now_s) for session in self.sessions]

    def is_late(self, time_s: float, arrived_s: float) -> bool:
        """Tell whether what was taken at `time_s` came too late to tell of now; count it."""
        if math.isinf(self.speed):
            return False
        if time.monotonic() - arrived_s > LATE_S:  # it has waited here
            self.counters.late += 1
            return True
        due_s = time_s / self.speed
        lead = arrived_s - due_s
        if self._quickest is not None:
            quickest, since_s = self._quickest
            lead = min(lead, quickest + _FORGET * (arrived_s - since_s))
        self._quickest = lead, arrived_s
        late = arrived_s - due_s - lead > LATE_S
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


# From vibration to percepts, by RA-II.

Floats = NDArray[np.float32]
JUMP_S = 0.002
"""Sound whose time is off by more than this from the samples' count has lost some."""


class AudioSense(Sense):
    """A microphone, or other vibration channels: what models feel by it, or what is heard.

    Parameters
    ----------
    encoding
        What samples are made by.
    rate_hz, n_channels
        Of the vibration.
    offset_s
        The microphone's clock is ahead of the camera's by this much, s.
    networks
        Models that take such samples; none to listen only.
    """

    raster: VibrationRaster | None = None

    def __init__(
        self,
        encoding: VibrationEncoding,
        rate_hz: float,
        n_channels: int = 1,
        offset_s: float = 0.0,
        networks: Sequence[Network] = (),
    ) -> None:
        """Wait for the first window to fill."""
        self.sound_quality = AudioQuality(rate_hz)
        super().__init__("audio", rate_hz, networks, self.sound_quality)
        self.encoding = encoding
        self.every_s = float(getattr(encoding, "stride_s", 1.0))
        self.n_channels = n_channels
        self.offset_s = offset_s
        self.newest: Ready | None = None
        self._stream = encoding.stream(rate_hz, n_channels)
        self._next_s: float | None = None

    @classmethod
    def of(cls, networks: Sequence[Network], offset_s: float = 0.0) -> Self:
        """Return the sense by which one or more models feel.

        Raises
        ------
        InputError
            If they learnt from different rates or spectra.
        """
        first, card = networks[0], networks[0].card
        require_alike(networks, ("sample_rate_hz", "encoding", "shape"), "sample rate and spectra")
        if not isinstance(first.encoding, VibrationEncoding):
            raise InputError(
                f"{first.path}: expected an encoding of vibration, found {first.encoding.name}"
            )
        assert card.sample_rate_hz is not None
        return cls(first.encoding, card.sample_rate_hz, card.shape[0], offset_s, networks)

    def begin(self, event: Begin) -> None:
        """Wait for the first window of another recording."""
        self._stream.skip()
        self.newest = self._next_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: samples are missing before the next one."""
        self._stream.skip()
        if self.raster is not None:
            self.raster.skip()
        super().skip()

    def hear(self, sound: Sound) -> list[Percept]:
        """Take in some samples."""
        time_s = sound.time_s - self.offset_s
        self.counters.samples += len(sound.samples)
        if self._next_s is not None and abs(gap_s := time_s - self._next_s) > JUMP_S:
            self.counters.lost_samples += max(0, round(gap_s * self.rate_hz))
            self.skip()
        self.now_s = self._next_s = time_s + len(sound.samples) / self.rate_hz
        late = self.is_late(self.now_s, sound.arrived_s)
        self.sound_quality.take(sound)
        if self.raster is not None:
            self.raster.take(time_s, sound.samples)
        ready = self._stream.feed(time_s, sound.samples)
        if ready:
            self.newest = ready[-1]
        if ready and late:
            return self.without("stalled")
        percepts = [
            session.feel(sample.values, sample.end_s, self.every_s, sound.arrived_s)
            for sample in ready
            for session in self.sessions
        ]
        return [percept for percept in percepts if percept]

    def spectrum(self) -> tuple[Floats, float] | None:
        """Return the newest sample's amplitudes, mean over channels, and their distance, Hz.

        None before there is one, or where samples are no spectra.
        """
        encoding, newest = self.encoding, self.newest
        if newest is None or not isinstance(encoding, SpectralEncoding):
            return None
        points = encoding.fft_points or encoding.window_s * self.rate_hz
        return newest.values.mean(axis=0), self.rate_hz / points


# From frames to percepts, by SA-I and RA-I.

MISSING = 1.7
"""Frames farther apart than this multiple of their period have lost others between them."""
DOUBLED = 0.25
"""A frame that comes within this share of the period is the one before once more."""


class VideoSense(Sense):
    """A sensor's camera: what models feel by it, or what is to be seen.

    Parameters
    ----------
    images
        Which follow the sensor's markers.
    rate_hz
        Frames a second.
    networks
        Models of this sensor; none to look only.
    """

    raster: MarkerRaster | None = None

    def __init__(
        self, images: FrameByFrame, rate_hz: float, networks: Sequence[Network] = ()
    ) -> None:
        """Wait for the rest frame."""
        self.picture_quality = VideoQuality(rate_hz)
        super().__init__("video", rate_hz, networks, self.picture_quality)
        self.felt: FrameImages | None = None
        self.picture: CameraFrame | None = None
        self.images = images
        self._last_s: float | None = None

    @classmethod
    def of(cls, networks: Sequence[Network]) -> Self:
        """Return the sense by which one or more models feel.

        Raises
        ------
        InputError
            If they learnt from different sensors or frame rates.
        """
        card = networks[0].card
        require_alike(networks, ("sensor", "fps_hz"), "sensor and frame rate")
        sensor = networks[0].part(Sensor, card.sensor, "a sensor file")
        felt_by = {network.channel for network in networks}
        assert card.fps_hz is not None
        return cls(Images(sensor, {*SHOWN, *felt_by}), card.fps_hz, networks)

    def begin(self, event: Begin) -> None:
        """Wait for the rest frame of another recording."""
        self.images.begin()
        self.felt = self._last_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next one."""
        self.images.skip()
        if self.raster is not None:
            self.raster.skip()
        super().skip()

    def see(self, picture: CameraFrame) -> list[Percept]:
        """Take in a frame."""
        self.counters.frames += 1
        if picture.torn:
            self.counters.torn += 1
            self._last_s = picture.time_s
            self.skip()
            return []
        if self._comes_twice(picture.time_s):
            self.counters.doubled += 1
            return []
        self.now_s = picture.time_s + 1 / self.rate_hz
        self.picture = picture
        try:
            felt = self.felt = self.images.feed(picture.frame)
        except InputError as error:
            self.images.begin()
            self.felt = None
            self.picture_quality.take(picture, None)
            return self.interrupt(Trouble("video", picture.time_s, str(error)), "waiting")
        self.picture_quality.take(picture, felt)
        late = self.is_late(picture.time_s, picture.arrived_s)
        if felt is None:
            return []
        if self.raster is not None:
            self.raster.take(picture.time_s, felt)
        if late:
            super().skip()  # the networks have not seen it; RA-I has
            return self.without("stalled")
        said = [
            session.see(felt, self.now_s, self.every_s, picture.arrived_s)
            for session in self.sessions
        ]
        return [percept for percept in said if percept is not None]

    def _comes_twice(self, time_s: float) -> bool:
        """Tell whether a frame is the last once more; count those missing before it."""
        last = self._last_s
        periods = 1.0 if last is None else (time_s - last) * self.rate_hz
        if periods < DOUBLED:
            return True
        if periods > MISSING:
            self.counters.dropped += round(periods) - 1
            self.skip()
        self._last_s = time_s
        return False

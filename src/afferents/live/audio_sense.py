"""From vibration to percepts, by RA-II."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.encodings import Ready, SpectralEncoding, VibrationEncoding
from afferents.live.audio_quality import AudioQuality
from afferents.live.events import Begin, Sound
from afferents.live.network import Network
from afferents.live.percept import Percept
from afferents.live.raster import VibrationRaster
from afferents.live.sense import Sense, require_alike

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
            raise InputError(first.path, "an encoding of vibration", first.encoding.name)
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

"""Models that feel: senses made for what the models learnt from."""

from collections.abc import Sequence

from afferents.core.errors import InputError
from afferents.live.audio_sense import AudioSense
from afferents.live.network import Network
from afferents.live.screen import Screen
from afferents.live.senses import Senses, check_offset
from afferents.live.terminal import Bars
from afferents.live.video_sense import VideoSense
from afferents.live.wanted import Wanted


class Perceiver(Senses):
    """Models that feel by video, by audio, or by both.

    Parameters
    ----------
    networks
        One or more, of one sensor.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Raises
    ------
    InputError
        If there is none, or two learnt from different sensors, rates or spectra.
    """

    def __init__(self, networks: Sequence[Network], audio_offset_s: float = 0.0) -> None:
        """Prepare for the first frame and the first sample."""
        check_offset(audio_offset_s)
        if not networks:
            raise InputError("--model", "at least one model", "none")
        self._networks = networks
        names = [network.card.model for network in networks]
        for name in names:
            if names.count(name) > 1:
                raise InputError("--model", "each model once", f"several of {name}")
        images = [network for network in networks if not network.encoding.of_vibration]
        vibration = [network for network in networks if network.encoding.of_vibration]
        super().__init__(
            VideoSense.of(images) if images else None,
            AudioSense.of(vibration, audio_offset_s) if vibration else None,
        )

    @property
    def wanted(self) -> Wanted:
        """What its models need of sources."""
        video, audio = self.video, self.audio
        return Wanted(
            frozenset(self.by_channel),
            sensor=video.images.sensor if video else None,
            fps_hz=video.rate_hz if video else None,
            sample_rate_hz=audio.rate_hz if audio else Wanted.sample_rate_hz,
            n_channels=audio.n_channels if audio else Wanted.n_channels,
        )

    def screen(self) -> Screen:
        """Return what draws percepts in a terminal: bars of every model."""
        networks = self._networks
        return Bars({network.card.model: network.card.most_sure for network in networks})

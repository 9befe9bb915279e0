"""From events to percepts, one at a time, without a thread of its own: the core of the stream."""

import math
from collections.abc import Sequence

from afferents.core.errors import InputError
from afferents.live.audio_sense import AudioSense
from afferents.live.events import Begin, CameraFrame, Channel, Event, Sound
from afferents.live.network import Network
from afferents.live.percept import Percept
from afferents.live.sense import Sense
from afferents.live.video_sense import VideoSense


class Perceiver:
    """Models that feel by video, by audio, or by both.

    Events may come in pieces of any size: percepts are the same. Memory does not grow.

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
        if not math.isfinite(audio_offset_s):
            raise InputError("--audio-offset-ms", "a number of milliseconds", f"{audio_offset_s}")
        if not networks:
            raise InputError("--model", "at least one model", "none")
        names = [network.card.model for network in networks]
        for name in names:
            if names.count(name) > 1:
                raise InputError("--model", "each model once", f"several of {name}")
        images = [network for network in networks if not network.encoding.of_vibration]
        vibration = [network for network in networks if network.encoding.of_vibration]
        self.video = VideoSense(images) if images else None
        self.audio = AudioSense(vibration, audio_offset_s) if vibration else None

    @property
    def senses(self) -> dict[Channel, Sense]:
        """The senses that its models have."""
        both: dict[Channel, Sense | None] = {"video": self.video, "audio": self.audio}
        return {channel: sense for channel, sense in both.items() if sense is not None}

    def feed(self, event: Event) -> list[Percept]:
        """Take in an event; return what it makes the models feel."""
        if isinstance(event, CameraFrame):
            return self.video.see(event) if self.video else []
        if isinstance(event, Sound):
            return self.audio.hear(event) if self.audio else []
        sense = self.senses.get(event.channel)
        if sense is None:
            return []
        if isinstance(event, Begin):
            sense.begin(event)
            return []
        return sense.interrupt(event)

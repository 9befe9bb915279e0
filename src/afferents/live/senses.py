"""What takes events in, one at a time, without a thread of its own: the core of the stream."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

from afferents.core.errors import InputError
from afferents.live.audio_sense import AudioSense
from afferents.live.events import Begin, CameraFrame, Channel, Event, Sound
from afferents.live.percept import Percept
from afferents.live.raster import MarkerRaster, Trains, VibrationRaster
from afferents.live.screen import Screen
from afferents.live.sense import Sense
from afferents.live.session import Session
from afferents.live.video_sense import VideoSense


class Senses(ABC):
    """A camera, a microphone, or both, and who listens to them: models, or an onlooker.

    Events may come in pieces of any size: percepts are the same. Memory does not grow.

    Attributes
    ----------
    video, audio
        None for a sense that is not there.
    """

    def __init__(self, video: VideoSense | None, audio: AudioSense | None) -> None:
        """Prepare for the first frame and the first sample."""
        self.video, self.audio = video, audio

    @abstractmethod
    def screen(self) -> Screen:
        """Return what draws percepts in a terminal."""

    @property
    def by_channel(self) -> dict[Channel, Sense]:
        """The senses that are there."""
        both: dict[Channel, Sense | None] = {"video": self.video, "audio": self.audio}
        return {channel: sense for channel, sense in both.items() if sense is not None}

    @property
    def sessions(self) -> Sequence[tuple[Channel, Session]]:
        """Who says something, and of which sense."""
        return [
            (channel, session)
            for channel, sense in self.by_channel.items()
            for session in sense.sessions
        ]

    def show_spikes(self) -> None:
        """From now on simulate units that the senses drive, for `trains`."""
        if self.video is not None:
            self.video.raster = MarkerRaster()
        if self.audio is not None:
            self.audio.raster = VibrationRaster(self.audio.rate_hz)

    def trains(self) -> list[Trains]:
        """Return which units fired in the last second, a class after the other."""
        rasters = [sense.raster for sense in self.by_channel.values()]
        return [trains for raster in rasters if raster is not None for trains in raster.trains()]

    def feed(self, event: Event) -> list[Percept]:
        """Take in an event; return what is to be said of it."""
        if isinstance(event, CameraFrame):
            return self.video.see(event) if self.video else []
        if isinstance(event, Sound):
            return self.audio.hear(event) if self.audio else []
        sense = self.by_channel.get(event.channel)
        if sense is None:
            return []
        if isinstance(event, Begin):
            sense.begin(event)
            return []
        return sense.interrupt(event)


def check_offset(audio_offset_s: float) -> None:
    """Refuse an offset of the clocks that is no number.

    Raises
    ------
    InputError
        Naming the option.
    """
    if not math.isfinite(audio_offset_s):
        raise InputError("--audio-offset-ms", "a number of milliseconds", f"{audio_offset_s}")

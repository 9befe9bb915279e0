"""What takes events in: senses made for models that feel, or for what the sources give."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.live.events import Begin, CameraFrame, Channel, Event, Sound, Source, Wanted
from afferents.live.images import FoundImages, FrameByFrame
from afferents.live.network import Network
from afferents.live.percept import Percept, Screen
from afferents.live.raster import MarkerRaster, Trains, VibrationRaster
from afferents.live.sense import AudioSense, Sense, VideoSense
from afferents.live.session import PredictionSession
from afferents.live.terminal import Bars, Pictures


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
    def sessions(self) -> Sequence[tuple[Channel, PredictionSession]]:
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
        raise InputError(
            f"--audio-offset-ms: expected a number of milliseconds, found {audio_offset_s}"
        )


# Models that feel: senses made for what the models learnt from.


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
            raise InputError("--model: expected at least one model, found none")
        self._networks = networks
        names = [network.card.model for network in networks]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"--model: expected each model once, found several of {name}")
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


# Looking before anything is learnt: senses made for what the sources give.


class Looker(Senses):
    """Shows markers, SA-I, RA-I, the spectrum and how good they are, without a model.

    Parameters
    ----------
    sources
        Which are looked at, one of each channel at most.
    images
        Which follow the markers that the camera sees: `Images` of a sensor, or `FoundImages`
        (the default), which finds markers at rest as `calibrate` does.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Raises
    ------
    InputError
        If there is no source.
    """

    def __init__(
        self,
        sources: Sequence[Source],
        images: FrameByFrame | None = None,
        audio_offset_s: float = 0.0,
    ) -> None:
        """Prepare for the first frame and the first sample."""
        check_offset(audio_offset_s)
        rates: dict[Channel, float] = {source.channel: source.rate_hz for source in sources}
        if not rates:
            raise InputError(
                "--video: expected a source to look at, such as camera:0, a video file or rig, "
                "found none; give --video, --audio or both"
            )
        video = audio = None
        if "video" in rates:
            video = VideoSense(images or FoundImages(), rates["video"])
        if "audio" in rates:
            audio = AudioSense(SpectralEncoding(), rates["audio"], offset_s=audio_offset_s)
        super().__init__(video, audio)

    def screen(self) -> Screen:
        """Return what draws percepts in a terminal: pictures of what comes in."""
        return Pictures(self.video, self.audio)

"""The live pipeline: from what a camera and a microphone give to predictions."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.lab.live.events import (
    Begin,
    Channel,
    Event,
    Source,
    Trouble,
    Wanted,
    require_finite,
)
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.raster import MarkerRaster, Trains, VibrationRaster
from afferents.lab.live.reporters import Reporter
from afferents.lab.live.sensor_streams import AudioStream, SensorStream, VideoStream
from afferents.markers.sensor import Sensor

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import Lessons


class LivePipeline:
    """A camera, a microphone, or both, with the models that classify by them, or without any.

    Events may come in pieces of any size: predictions are the same. Memory does not grow.

    Parameters
    ----------
    video, audio
        None for one that is not there. `with_models` and `without_models` make them.
    """

    def __init__(self, video: VideoStream | None, audio: AudioStream | None) -> None:
        """Prepare for the first frame and the first sample."""
        self.video, self.audio = video, audio
        self.lessons: Lessons | None = None
        both: dict[Channel, SensorStream | None] = {"video": video, "audio": audio}
        self.by_channel = {channel: one for channel, one in both.items() if one is not None}

    @classmethod
    def with_models(cls, networks: Sequence[Network], audio_offset_s: float = 0.0) -> Self:
        """Return a pipeline of models: streams are made for what they learnt from.

        Parameters
        ----------
        networks
            One or more, of one sensor.
        audio_offset_s
            The microphone's clock is ahead of the camera's by this much, s.

        Raises
        ------
        InputError
            If there is none, two learnt from different sensors, rates or spectra, or the offset is
            no finite number.
        """
        require_finite(audio_offset_s)
        if not networks:
            raise InputError("--model: expected at least one model, found none")
        names = [network.card.model for network in networks]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"--model: expected each model once, found several of {name}")
        images = [network for network in networks if not network.encoding.of_vibration]
        vibration = [network for network in networks if network.encoding.of_vibration]
        return cls(
            VideoStream.of(images) if images else None,
            AudioStream.of(vibration, audio_offset_s) if vibration else None,
        )

    @classmethod
    def without_models(
        cls,
        sources: Sequence[Source],
        sensor: Sensor | None = None,
        audio_offset_s: float = 0.0,
    ) -> Self:
        """Return a pipeline that shows markers, SA-I, RA-I, spectrum, and how good they are.

        Parameters
        ----------
        sources
            Which are looked at, one of each channel at most.
        sensor
            Whose markers the camera sees; None to find them at rest, as `calibrate` does.
        audio_offset_s
            The microphone's clock is ahead of the camera's by this much, s.

        Raises
        ------
        InputError
            If there is no source, its sound has too few samples a second for a spectrum, or the
            offset is no finite number.
        """
        require_finite(audio_offset_s)
        rates: dict[Channel, float] = {source.channel: source.rate_hz for source in sources}
        if not rates:
            raise InputError(
                "--video: expected a source to look at, such as camera:0, a video file or rig, "
                "found none; give --video, --audio or both"
            )
        video = audio = None
        if "video" in rates:
            video = VideoStream(sensor, rates["video"])
        if "audio" in rates:
            audio = _listening(rates["audio"], audio_offset_s)
        return cls(video, audio)

    @property
    def wanted(self) -> Wanted:
        """What is needed of sources."""
        video, audio = self.video, self.audio
        return Wanted(
            frozenset(self.by_channel),
            sensor=video.follower.sensor if video else None,
            fps_hz=video.rate_hz if video else None,
            sample_rate_hz=audio.rate_hz if audio else Wanted.sample_rate_hz,
            n_channels=audio.n_channels if audio else Wanted.n_channels,
        )

    @property
    def reporters(self) -> Sequence[tuple[Channel, Reporter]]:
        """Who says something, and of which channel."""
        return [
            (channel, reporter)
            for channel, stream in self.by_channel.items()
            for reporter in stream.reporters
        ]

    def set_rest(self) -> bool:
        """Let displacement count from where the markers are now; tell whether there are any.

        Whether it was set, or why not, comes among the troubles of a prediction ten frames later.
        """
        if self.video is not None:
            self.video.follower.set_rest()
        return self.video is not None

    def learn(self, folder: Path, simulated: bool = False) -> None:
        """Let textures be taught from now on, and say what is recognised of them; see `Lessons`.

        Raises
        ------
        InputError
            If there are no images to learn from, or the folder is not one of such lessons.
        """
        from afferents.lab.live.lessons import Lessons

        if self.video is None:
            raise InputError("--learn: expected a source of images (--video), found none")
        rate_hz = self.audio.rate_hz if self.audio else None
        sensor = self.video.follower.sensor
        self.lessons = Lessons(folder, sensor, self.video.rate_hz, rate_hz, simulated)
        self.video.learn(self.lessons)
        if self.audio is not None:
            self.audio.lessons = self.lessons

    def show_spikes(self) -> None:
        """From now on simulate units that the responses drive, for `trains`."""
        if self.video is not None:
            self.video.raster = MarkerRaster()
        if self.audio is not None:
            self.audio.raster = VibrationRaster(self.audio.rate_hz)

    def trains(self) -> list[Trains]:
        """Return which units fired in the last second, a class after the other."""
        return [train for one in self.by_channel.values() for train in one.raster.trains()]

    def feed(self, event: Event) -> Iterator[Prediction]:
        """Take in an event, and yield what is predicted.

        No prediction waits for what is found out about quality and spikes: that comes after the
        last of them, so take them all.
        """
        stream = self.by_channel.get(event.channel)
        if stream is None:
            return
        if isinstance(event, Begin):
            yield from stream.end()
            stream.begin(event)
        elif isinstance(event, Trouble):
            yield from stream.interrupt(event)
        else:
            yield from stream.feed(event)


def _listening(rate_hz: float, offset_s: float) -> AudioStream:
    """Return a stream without models."""
    encoding = SpectralEncoding()
    try:
        return AudioStream(encoding, rate_hz, offset_s=offset_s)
    except InputError as error:  # of options that only 'extract' and 'evaluate' have
        least_hz = 2 * encoding.model_bins / encoding.window_s
        raise InputError(
            f"--audio: expected sound of at least {least_hz:g} Hz, found {rate_hz:g}; leave it out"
        ) from error

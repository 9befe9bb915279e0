"""The live pipeline: from what running sources give to predictions."""

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.lab.live import events, raster
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.reporters import Reporter
from afferents.lab.live.streams import SILENT_S, AudioStream, SensorStream, VideoStream
from afferents.markers.sensor import Sensor
from afferents.recordings.check import RATE_TOLERANCE

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import Lessons

Model = str | Path | Network


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
        both: dict[events.Channel, SensorStream | None] = {"video": video, "audio": audio}
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
        events.require_offset(audio_offset_s)
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
        sources: Sequence[events.Source],
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
        events.require_offset(audio_offset_s)
        rates: dict[events.Channel, float] = {source.channel: source.rate_hz for source in sources}
        if not rates:
            raise InputError(
                "--video: expected a source to look at, such as camera:0, a video file or rig, "
                "found none; give --video, --audio or both"
            )
        video = audio = None
        if "video" in rates:
            video = VideoStream(sensor, rates["video"])
        if "audio" in rates:
            encoding, rate_hz = SpectralEncoding(), rates["audio"]
            try:
                audio = AudioStream(encoding, rate_hz, offset_s=audio_offset_s)
            except InputError as error:  # of options that only 'extract' and 'evaluate' have
                least_hz = 2 * encoding.model_bins / encoding.window_s
                raise InputError(
                    f"--audio: expected sound of at least {least_hz:g} Hz, found {rate_hz:g}; "
                    "leave it out"
                ) from error
        return cls(video, audio)

    @property
    def wanted(self) -> events.Wanted:
        """What is needed of sources."""
        video, audio = self.video, self.audio
        return events.Wanted(
            frozenset(self.by_channel),
            sensor=video.follower.sensor if video else None,
            fps_hz=video.rate_hz if video else None,
            sample_rate_hz=audio.rate_hz if audio else events.Wanted.sample_rate_hz,
            n_channels=audio.n_channels if audio else events.Wanted.n_channels,
        )

    @property
    def reporters(self) -> Sequence[tuple[events.Channel, Reporter]]:
        """What reports predictions, and of which channel."""
        return [
            (channel, reporter)
            for channel, stream in self.by_channel.items()
            for reporter in stream.reporters
        ]

    def set_rest(self) -> bool:
        """Let displacement count from where the markers are now; return whether there are any.

        Whether it was set, or why not, comes among the troubles of a prediction ten frames later.
        """
        if self.video is not None:
            self.video.follower.set_rest()
        return self.video is not None

    def learn(self, folder: Path, simulated: bool = False) -> None:
        """Let textures be taught from now on, and report what is recognised of them; see `Lessons`.

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
        raster.compile_units()
        if self.video is not None:
            self.video.raster = raster.MarkerRaster()
        if self.audio is not None:
            self.audio.raster = raster.VibrationRaster(self.audio.rate_hz)

    def trains(self) -> list[raster.Trains]:
        """Return which units fired in the last second, a class after the other."""
        return [train for one in self.by_channel.values() for train in one.raster.trains()]

    def feed(self, event: events.Event) -> Iterator[Prediction]:
        """Take in an event, and yield what is predicted.

        No prediction waits for quality and spikes: they are worked out after the last of them, so
        take them all.
        """
        stream = self.by_channel.get(event.channel)
        if stream is None:
            return
        if isinstance(event, events.Begin):
            yield from stream.end()
            stream.begin(event)
        elif isinstance(event, events.Trouble):
            yield from stream.interrupt(event)
        else:
            yield from stream.feed(event)


def stream(
    sources: Sequence[events.Source], models: Model | Sequence[Model], audio_offset_s: float = 0.0
) -> Iterator[Prediction]:
    """Classify with models as sources run; ends when all sources have ended.

    A source with a finite speed (a camera, a microphone, a paced replay) runs in a thread of its
    own, and what can't be followed is dropped and counted. Otherwise events are taken in the
    order of their times, none is lost, and the predictions are the same at every run.

    Parameters
    ----------
    sources
        At most one video and one audio source.
    models
        An exported model or several, read or as paths.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Yields
    ------
    Prediction
        At every frame and every stride of the vibration; where none comes, every half second
        that there is none, and why; at least one of each model. Stop early by closing the
        generator.

    Raises
    ------
    InputError
        If a model has no source, or one of another rate.
    """
    several = [models] if isinstance(models, str | Path | Network) else models
    with events.close_afterwards(sources):
        networks = [m if isinstance(m, Network) else Network(Path(m)) for m in several]
        yield from run(sources, LivePipeline.with_models(networks, audio_offset_s))


def run(sources: Sequence[events.Source], pipeline: LivePipeline) -> Iterator[Prediction]:
    """Feed sources to a pipeline; see `stream`."""
    used = [source for source in sources if source.channel in pipeline.by_channel]
    streams = pipeline.by_channel
    with events.close_afterwards(sources):
        check_sources(sources, pipeline)
        for source in used:
            streams[source.channel].start(source.speed)
        if any(math.isfinite(source.speed) for source in used):
            mailbox = events.Mailbox()
            for source in used:
                mailbox.take_from(source)
            for event in mailbox.take(SILENT_S / 5):
                if event is not None:
                    for prediction in pipeline.feed(event):
                        yield prediction
                        streams[event.channel].reported_s = time.monotonic()
                for channel, stream in streams.items():
                    yield from stream.break_silence(mailbox.last_s.get(channel))
        else:
            for event in events.take_in_order(used):
                yield from pipeline.feed(event)
        for stream in streams.values():
            yield from stream.end()
            silent = [reporter for reporter in stream.reporters if not reporter.has_reported]
            yield from (reporter.predict("waiting", stream.now_s) for reporter in silent)


def check_sources(sources: Sequence[events.Source], pipeline: LivePipeline) -> None:
    """Refuse sources that don't go with the pipeline.

    Raises
    ------
    InputError
        If a stream has no source or two, or the rate is another than the models learnt from.
    """
    units = {"video": ("frames/s", RATE_TOLERANCE), "audio": ("Hz", 0.0)}
    for channel, stream in pipeline.by_channel.items():
        fitting = [source for source in sources if source.channel == channel]
        if len(fitting) != 1:
            listening = ", ".join(reporter.name for reporter in stream.reporters)
            found = f"{len(fitting) or 'none'}"
            raise InputError(f"--{channel}: expected one source for {listening}, found {found}")
        rate_hz, (unit, tolerance) = fitting[0].rate_hz, units[channel]
        if abs(rate_hz - stream.rate_hz) > tolerance * stream.rate_hz:
            raise InputError(
                f"--{channel}: expected {stream.rate_hz:g} {unit}, as the model learnt from, found "
                f"{rate_hz:g}; use a source of that rate, or train a model for this one"
            )

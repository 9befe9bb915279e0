"""A stream of predictions from running sources."""

import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from afferents.errors import InputError
from afferents.lab.live.events import Channel, Mailbox, Source, Trouble, in_order, let_go
from afferents.lab.live.network import Network
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.sensor_streams import SensorStream

SILENT_S = 0.5
"""A source that says nothing for so long is stalled; and nobody waits longer for a message."""
START_S = 3.0
"""So long a source may take for its first message: cameras start slowly, and so does the rig."""
RATE_TOLERANCE = 0.1
"""How far a source's frame rate may lie from what the model learnt from, as a share of it."""


Model = str | Path | Network


def stream(
    sources: Sequence[Source], models: Model | Sequence[Model], audio_offset_s: float = 0.0
) -> Iterator[Prediction]:
    """Classify with models as sources run; ends when all sources have ended.

    A source with a finite speed (a camera, a microphone, a paced replay) runs in a thread of its
    own, and whatever can't be followed is dropped and counted. Otherwise events are taken in the
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
    with let_go(sources):
        networks = [m if isinstance(m, Network) else Network(Path(m)) for m in several]
        yield from run(sources, LivePipeline.with_models(networks, audio_offset_s))


def run(sources: Sequence[Source], pipeline: LivePipeline) -> Iterator[Prediction]:
    """Feed sources to a pipeline; see `stream`."""
    used = [source for source in sources if source.channel in pipeline.by_channel]
    with let_go(sources):
        check_sources(sources, pipeline)
        for source in used:
            pipeline.by_channel[source.channel].speed = source.speed
        if any(math.isfinite(source.speed) for source in used):
            yield from _as_it_comes(used, pipeline)
        else:
            for event in in_order(used):
                yield from pipeline.feed(event)
        for stream in pipeline.by_channel.values():
            yield from stream.end()
            silent = [reporter for reporter in stream.reporters if not reporter.spoke]
            yield from (reporter.predict("waiting", stream.now_s) for reporter in silent)


def check_sources(sources: Sequence[Source], pipeline: LivePipeline) -> None:
    """Refuse sources that don't go with the pipeline.

    Raises
    ------
    InputError
        If a stream has no source or two, or the rate is another than the models learnt from.
    """
    for channel, stream in pipeline.by_channel.items():
        fitting = [source for source in sources if source.channel == channel]
        if len(fitting) != 1:
            listening = ", ".join(reporter.name for reporter in stream.reporters)
            found = f"{len(fitting) or 'none'}"
            raise InputError(f"--{channel}: expected one source for {listening}, found {found}")
        _check_rate(fitting[0], stream)


def _check_rate(source: Source, stream: SensorStream) -> None:
    unit, tolerance = ("frames/s", RATE_TOLERANCE) if source.channel == "video" else ("Hz", 0.0)
    if abs(source.rate_hz - stream.rate_hz) > tolerance * stream.rate_hz:
        raise InputError(
            f"--{source.channel}: expected {stream.rate_hz:g} {unit}, as the model learnt from, "
            f"found {source.rate_hz:g}; use a source of that rate, or train a model for this one"
        )


def _as_it_comes(sources: Sequence[Source], pipeline: LivePipeline) -> Iterator[Prediction]:
    mailbox = Mailbox()
    watches = {s.channel: _SilenceWatch(pipeline.by_channel[s.channel]) for s in sources}
    for source in sources:
        mailbox.take_from(source)
    while True:
        try:
            event = mailbox.get(SILENT_S / 5)
        except EOFError:
            return
        if event is not None:
            for prediction in pipeline.feed(event):
                yield prediction
                watches[event.channel].said_s = time.monotonic()
        for channel, watch in watches.items():
            yield from watch.break_silence(mailbox.last_s.get(channel))


class _SilenceWatch:
    """Sees that nobody takes an old prediction for a fresh one."""

    def __init__(self, stream: SensorStream) -> None:
        self._stream = stream
        self._begun_s = self.said_s = time.monotonic()
        self._named_s = -math.inf  # with what the silence began that was named last

    def break_silence(self, last_s: float | None) -> list[Prediction]:
        """Return what is to be said where nothing was said for long.

        Parameters
        ----------
        last_s
            When the source last gave something, whether it was taken already or not.
        """
        now_s = time.monotonic()
        if now_s - self.said_s < max(SILENT_S, 2 * self._stream.every_s):
            return []
        self.said_s = now_s
        since_s = self._begun_s if last_s is None else last_s
        silent_s = now_s - since_s
        if silent_s < (START_S if last_s is None else SILENT_S):
            return self._stream.report_nothing("waiting")
        if since_s == self._named_s:  # one silence is one trouble, however long
            return self._stream.report_nothing("stalled")
        self._named_s = since_s
        channel: Channel = self._stream.channel
        what = f"{channel}: nothing for {silent_s:.1f} s"
        self._stream.quality.begin()
        return self._stream.interrupt(Trouble(channel, self._stream.now_s, what))

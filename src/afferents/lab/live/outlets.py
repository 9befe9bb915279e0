"""Where predictions go: a page, the terminal, JSON lines, Lab Streaming Layer."""

import json
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from afferents import errors, plugins
from afferents.lab.live import events, network, replay, terminal
from afferents.lab.live.control import set_rest_on_request
from afferents.lab.live.pipeline import LivePipeline, check_sources, run
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.sources import find_sensor, open_sources
from afferents.markers.sensor import load_sensor

SHORT = (
    "--video, --audio: expected recordings that are long enough for a prediction, found an end "
    "before the first; give longer ones, or --speed 0.2 if this machine can't keep up"
)
PROBABILITIES, MESSAGES = "afferents probabilities", "afferents percepts"


def publish(
    predictions: Iterable[Prediction], textures: Mapping[str, Sequence[str]]
) -> Iterator[Prediction]:
    """Pass predictions on, and give them out by LSL.

    Two outlets a model: its probabilities, one channel a texture (NaN where nothing fresh is
    known), and every prediction as JSON. Without a model there is only the latter.

    Parameters
    ----------
    predictions
        Passed on.
    textures
        Of each model, by the name in its predictions; none without a model.

    Raises
    ------
    InputError
        If pylsl or the LSL library is missing.
    """
    pylsl = plugins.import_extra("lsl", "--lsl", "pylsl")
    numbers: dict[str, Any] = {}
    given: dict[str, list[str]] = {}

    def open_numbers(name: str, several: list[str]) -> None:
        if not several or given.get(name) == several:
            return
        given[name] = several  # more may be taught later
        described = pylsl.StreamInfo(
            f"{PROBABILITIES} {name}", "Touch", len(several), 0, "float32", f"afferents-{name}"
        )
        channels = described.desc().append_child("channels")
        for texture in several:
            channels.append_child("channel").append_child_value("label", texture)
        numbers[name] = pylsl.StreamOutlet(described)

    messages = {}
    for name, several in textures.items():
        described = f"{MESSAGES} {name}", "Markers", 1, 0, "string", f"afferents-{name}-json"
        messages[name] = pylsl.StreamOutlet(pylsl.StreamInfo(*described))
        open_numbers(name, list(several))
    for prediction in predictions:
        open_numbers(prediction.model, list(prediction.evidence))
        if outlet := numbers.get(prediction.model):
            known = prediction.probabilities
            outlet.push_sample([known.get(texture, math.nan) for texture in prediction.evidence])
        messages[prediction.model].push_sample([json.dumps(prediction.to_dict())])
        yield prediction


def open_pipeline(
    model: Sequence[Path],
    video: str | None,
    audio: str | None,
    sensor: str | None,
    speed: float,
    fps_hz: float | None,
    exposure_ms: float | None,
    audio_offset_s: float,
) -> tuple[Sequence[events.Source], LivePipeline]:
    """Open sources, and make what is to be run on them: models, or a look at what comes in.

    Parameters
    ----------
    model
        ONNX files; none to look only. They carry sensor and frame rate.
    video, audio, speed, fps_hz, exposure_ms
        As for `sources.open_sources`.
    sensor
        Sensor file or name; None to find the markers.

    Raises
    ------
    InputError
        If there is no such model, source or sensor, or they don't go together.
    """
    if model:
        networks = [network.Network(path) for path in model]
        pipeline = LivePipeline.with_models(networks, audio_offset_s)
        return open_sources(video, audio, pipeline.wanted, speed, exposure_ms), pipeline
    known = find_sensor(video, load_sensor(sensor) if sensor else None, fps_hz)
    wanted = events.Wanted(sensor=known, fps_hz=fps_hz)
    sources = open_sources(video, audio, wanted, speed, exposure_ms, fps_hz)
    return sources, LivePipeline.without_models(sources, known, audio_offset_s)


Address = tuple[str, int, str | None]
"""Host, port and token of the page."""


def give_out(
    sources: Sequence[events.Source],
    pipeline: LivePipeline,
    web: Address | None = None,
    lsl: bool = False,
    as_json: bool = False,
    control: bool = False,
    greeting: Mapping[str, Any] | None = None,
) -> None:
    """Run a pipeline, and give out what it predicts or shows, until the sources end.

    Parameters
    ----------
    sources, pipeline
        As for `pipeline.run`.
    web
        Where a page is served; None for the terminal.
    lsl
        Whether LSL outlets are opened as well.
    as_json
        Whether predictions are printed as JSON lines.
    control
        Whether lines on standard input set rest and teach; see `set_rest_on_request`.
    greeting
        What the page is sent at first: ``name`` of the fingertip, and ``beside``, the ports of the
        pages of all, by name.

    Raises
    ------
    InputError
        As `pipeline.run`; if packages are missing, or the page can't be served there; without a
        page, if the sources end and nothing was ever known, as with another sensor's clip.
    """
    is_fresh, trouble = False, SHORT

    def give() -> Iterator[Prediction]:
        """Run the pipeline; what it predicts goes out as it passes."""
        nonlocal is_fresh, trouble
        predictions = run(sources, pipeline)
        if lsl:
            textures = {reporter.name: reporter.textures for _, reporter in pipeline.reporters}
            predictions = publish(predictions, textures)
        for prediction in predictions:
            is_fresh = is_fresh or prediction.fresh
            trouble = [trouble, *prediction.troubles][-1]
            if as_json:
                sys.stdout.write(json.dumps(prediction.to_dict()) + "\n")
                sys.stdout.flush()
            yield prediction

    def give_again() -> Iterator[Prediction]:
        for source in recorded:
            source.rewind()
        for channel, stream in pipeline.by_channel.items():
            stream.begin(events.Begin(channel, 0.0))
        return give()

    recorded = [source for source in sources if isinstance(source, replay.Played)]
    listening = set_rest_on_request(pipeline.set_rest, control, pipeline.lessons)
    with events.close_afterwards(sources), listening:
        check_sources(sources, pipeline)  # before anything is opened for the predictions
        if web is not None:
            from afferents.lab.live.web.server import serve

            pipeline.show_spikes()
            again = give_again if len(recorded) == len(sources) else None
            serve(give(), pipeline, *web, again, greeting or {})
        elif as_json:
            for _ in give():
                pass
        else:
            terminal.show(give(), pipeline)
        if web is None and not is_fresh:
            raise errors.InputError(trouble)

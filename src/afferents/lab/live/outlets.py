"""Where predictions go: a page, the terminal, JSON lines, Lab Streaming Layer."""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from afferents.errors import InputError
from afferents.lab.live.control import set_rest_when_asked
from afferents.lab.live.events import Begin, Source, let_go
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Prediction
from afferents.lab.live.replay import Played
from afferents.lab.live.stream import check_sources, run
from afferents.lab.live.terminal import show
from afferents.plugins import import_extra

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
    known), and every prediction as JSON. Where one looks without a model, there is only the latter.

    Parameters
    ----------
    predictions
        Passed on.
    textures
        Of each model, by the name in its predictions; none where one only looks.

    Raises
    ------
    InputError
        If pylsl or the LSL library is missing.
    """
    pylsl = import_extra("lsl", "--lsl", "pylsl")
    words = {name: pylsl.StreamOutlet(_words(pylsl, name)) for name in textures}
    given: dict[str, tuple[str, ...]] = {}
    numbers: dict[str, Any] = {}

    def open_numbers(name: str, several: Sequence[str]) -> None:
        if several and given.get(name) != tuple(several):  # more may be taught
            given[name] = tuple(several)
            numbers[name] = pylsl.StreamOutlet(_numbers(pylsl, name, several))

    for name, several in textures.items():
        open_numbers(name, several)
    nothing = float("nan")
    for prediction in predictions:
        open_numbers(prediction.model, tuple(prediction.evidence))
        if outlet := numbers.get(prediction.model):
            known = prediction.probabilities
            outlet.push_sample([known.get(texture, nothing) for texture in prediction.evidence])
        words[prediction.model].push_sample([json.dumps(prediction.to_dict())])
        yield prediction


def _numbers(pylsl: ModuleType, name: str, textures: Sequence[str]) -> Any:
    """Describe a stream of probabilities."""
    stream = pylsl.StreamInfo(
        f"{PROBABILITIES} {name}", "Touch", len(textures), 0, "float32", f"afferents-{name}"
    )
    channels = stream.desc().append_child("channels")
    for texture in textures:
        channels.append_child("channel").append_child_value("label", texture)
    return stream


def _words(pylsl: ModuleType, name: str) -> Any:
    """Describe a stream of predictions."""
    source = f"afferents-{name}-json"
    return pylsl.StreamInfo(f"{MESSAGES} {name}", "Markers", 1, 0, "string", source)


Address = tuple[str, int, str | None]
"""Host, port and token of the page."""


def give_out(
    sources: Sequence[Source],
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
        As for `stream.run`.
    web
        Where a page is served; None for the terminal.
    lsl
        Whether LSL outlets are opened as well.
    as_json
        Whether predictions are printed as JSON lines.
    control
        Whether lines on standard input set rest and teach; see `set_rest_when_asked`.
    greeting
        What the page is told at first: ``name`` of the fingertip, and ``beside``, the ports of the
        pages of all, by name.

    Raises
    ------
    InputError
        As `stream.run`; if packages are missing, or the page can't be served there; without a
        page, if the sources end and nothing was ever known, as of another sensor's clip.
    """
    with let_go(sources), set_rest_when_asked(pipeline.set_rest, control, pipeline.lessons):
        check_sources(sources, pipeline)  # before anything is opened for the predictions
        predictions = _predictions(sources, pipeline, lsl, as_json)
        if web is not None:
            from afferents.lab.live.web.server import serve

            def again() -> Iterator[Prediction]:
                for source in recorded:
                    source.rewind()
                for channel, stream in pipeline.by_channel.items():
                    stream.begin(Begin(channel, 0.0))
                return _predictions(sources, pipeline, lsl, as_json)

            recorded = [source for source in sources if isinstance(source, Played)]
            pipeline.show_spikes()
            repeat = again if len(recorded) == len(sources) else None
            serve(predictions, pipeline, *web, repeat, greeting or {})
        else:
            predictions = _require_any(predictions)
            if as_json:
                for _ in predictions:
                    pass
            else:
                show(predictions, pipeline)


def _predictions(
    sources: Sequence[Source], pipeline: LivePipeline, lsl: bool, as_json: bool
) -> Iterator[Prediction]:
    """Run the pipeline; what it predicts goes out as it passes."""
    predictions = run(sources, pipeline)
    if lsl:
        textures = {reporter.name: reporter.textures for _, reporter in pipeline.reporters}
        predictions = publish(predictions, textures)
    return _print(predictions) if as_json else predictions


def _require_any(predictions: Iterator[Prediction]) -> Iterator[Prediction]:
    """Pass predictions on; at their end, raise what kept all of them from being fresh."""
    fresh, trouble = False, SHORT
    for prediction in predictions:
        fresh = fresh or prediction.fresh
        trouble = [trouble, *prediction.troubles][-1]
        yield prediction
    if not fresh:
        raise InputError(trouble)


def _print(predictions: Iterator[Prediction]) -> Iterator[Prediction]:
    """Print predictions as they pass, one JSON object a line."""
    for prediction in predictions:
        sys.stdout.write(json.dumps(prediction.to_dict()) + "\n")
        sys.stdout.flush()
        yield prediction

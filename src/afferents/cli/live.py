"""What `afferents live` runs: models that classify, or none, to look on."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from afferents.cli.shared import Quiet
from afferents.errors import InputError
from afferents.models.model import BEST
from afferents.progress import Progress

if TYPE_CHECKING:
    from afferents.live.events import Source
    from afferents.live.pipeline import LivePipeline

DEMO = "demo"
"""Stands for the models of the simulated rig, which are trained if need be."""
Prepared = tuple[Sequence["Source"], "LivePipeline"]
"""Sources, opened, and the pipeline that takes what they give."""


class Asked(NamedTuple):
    """What is asked of the sources, as options of the command line say it.

    Attributes
    ----------
    video, audio
        By name; None for none.
    speed
        Of replays; infinite for as fast as possible.
    fps_hz, exposure_ms
        Of the camera; None for its own.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.
    """

    video: str | None
    audio: str | None
    speed: float = 1.0
    fps_hz: float | None = None
    exposure_ms: float | None = None
    audio_offset_s: float = 0.0


def prepare_models(asked: Asked, models: Sequence[Path], quiet: bool) -> Prepared:
    """Open what models need.

    Raises
    ------
    InputError
        If models or sources are missing, or do not go together.
    """
    from afferents.live.network import Network
    from afferents.live.pipeline import LivePipeline
    from afferents.live.sources import open_sources

    if asked.fps_hz is not None:
        raise InputError(
            f"--fps: expected none beside --model, which has its own, found {asked.fps_hz:g}"
        )
    paths = _demo(asked, quiet) if models == [Path(DEMO)] else models
    pipeline = LivePipeline.with_models([Network(path) for path in paths], asked.audio_offset_s)
    given = asked.speed, asked.exposure_ms
    return open_sources(asked.video, asked.audio, pipeline.wanted, *given), pipeline


def prepare_looking(asked: Asked, sensor: str | None) -> Prepared:
    """Open what is to be looked at, by a sensor's file or name; None to find its markers.

    Raises
    ------
    InputError
        If there is no source, or the sensor does not go with it.
    """
    from afferents.live.events import Wanted
    from afferents.live.pipeline import LivePipeline
    from afferents.live.sources import images_of, open_sources
    from afferents.markers.sensor import load_sensor

    if asked.fps_hz is not None and not 0 < asked.fps_hz < float("inf"):
        raise InputError(
            f"--fps: expected a number of frames a second above 0, found {asked.fps_hz:g}"
        )
    images = images_of(asked.video, load_sensor(sensor) if sensor else None)
    wanted = Wanted(sensor=images.sensor, fps_hz=asked.fps_hz)
    given = asked.speed, asked.exposure_ms
    sources = open_sources(asked.video, asked.audio, wanted, *given)
    return sources, LivePipeline.without_models(sources, images, asked.audio_offset_s)


def _demo(asked: Asked, quiet: bool) -> list[Path]:
    """Return exported models for sources of the simulated rig; they are trained if need be."""
    from afferents.reproduction.reproduce import demo_models

    named = [source for source in (asked.video, asked.audio) if source is not None]
    if not named or any(not source.startswith("rig") for source in named):
        raise InputError(
            f"--model {DEMO}: expected sources of the simulated rig, such as --video rig, found "
            f"{', '.join(named) or 'none'}; run 'afferents train' and 'afferents export' for "
            "others"
        )
    with Progress(quiet) as progress:
        both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (asked.video, asked.audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]


# The command.


def live(
    model: Annotated[
        list[Path] | None,
        typer.Option(
            help="ONNX file that 'export' wrote; may be repeated, to run several side by side; "
            "'demo' for the simulated rig's own (default: no model, look only)."
        ),
    ] = None,
    video: Annotated[
        str | None,
        typer.Option(
            help="Source of images: camera:0, a video file, replay:SESSION/3/50, rig or rig:g/50."
        ),
    ] = None,
    audio: Annotated[
        str | None,
        typer.Option(
            help="Source of sound: mic:default, a sound file, replay:SESSION/3/50, rig or rig:g/50."
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Without a model: sensor file (TOML) or name (default: markers are found at rest)."
        ),
    ] = None,
    speed: Annotated[
        str, typer.Option(help="How fast replays run: 1 as recorded, 8 times as fast, or max.")
    ] = "1",
    fps: Annotated[
        float | None,
        typer.Option(help="Without a model: frame rate asked of a camera (default: its own)."),
    ] = None,
    exposure_ms: Annotated[
        float | None, typer.Option(help="Exposure time of the camera, ms (default: unchanged).")
    ] = None,
    audio_offset_ms: Annotated[
        float,
        typer.Option(
            help="How far the microphone's clock is ahead of the camera's, ms; 'align' measures it."
        ),
    ] = 0.0,
    web: Annotated[
        bool, typer.Option("--web", help="Serve a web page instead of drawing in the terminal.")
    ] = False,
    host: Annotated[str, typer.Option(help="Address that the page is served at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page.")] = 8800,
    token: Annotated[
        str | None,
        typer.Option(help="Password for the page; required if other machines can reach it."),
    ] = None,
    lsl: Annotated[
        bool, typer.Option("--lsl", help="Also send predictions as streams of Lab Streaming Layer.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print predictions as JSON, one per line.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Look at what a fingertip senses, or classify texture while it slides.

    On a camera and a microphone, on a recording that is replayed, or on the simulated rig.
    Without a model it shows camera, markers, SA-I, RA-I, spectrum, and how good they are.
    Exported models say which texture they recognise.
    """
    from afferents.choices import speed_factor
    from afferents.live.outlets import give_out

    asked = Asked(video, audio, speed_factor(speed), fps, exposure_ms, audio_offset_ms / 1000)
    if model and sensor:
        raise InputError(
            f"--sensor: expected none beside --model, which carries its own, found {sensor}"
        )
    sources, pipeline = (
        prepare_models(asked, model, quiet or as_json) if model else prepare_looking(asked, sensor)
    )
    give_out(sources, pipeline, web=(host, port, token) if web else None, lsl=lsl, as_json=as_json)

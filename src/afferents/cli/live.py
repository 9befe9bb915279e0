"""What `afferents live` runs: models that classify, or none, to look on."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.shared import Host, Port, Quiet, Token
from afferents.errors import InputError
from afferents.models.model import BEST
from afferents.progress import Progress

DEMO = "demo"
"""Stands for the models of the simulated rig, which are trained if need be."""


def _demo(video: str | None, audio: str | None, quiet: bool) -> list[Path]:
    """Return exported models for sources of the simulated rig; they are trained if need be."""
    from afferents.reproduction.demo import demo_models

    named = [source for source in (video, audio) if source is not None]
    if not named or any(not source.startswith("rig") for source in named):
        raise InputError(
            f"--model {DEMO}: expected sources of the simulated rig, such as --video rig, found "
            f"{', '.join(named) or 'none'}; run 'afferents train' and 'afferents export' for "
            "others"
        )
    with Progress(quiet) as progress:
        both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (video, audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]


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
        typer.Option(
            help="Without a model: frame rate asked of a camera, or true rate of a recording or a "
            "folder of images (default: its own)."
        ),
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
    host: Host = "127.0.0.1",
    port: Port = 8800,
    token: Token = None,
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
    from afferents.live.events import Wanted
    from afferents.live.network import Network
    from afferents.live.outlets import give_out
    from afferents.live.pipeline import LivePipeline
    from afferents.live.sources import images_of, open_sources
    from afferents.markers.sensor import load_sensor
    from afferents.recordings.session_file import rate_in

    factor, offset_s = speed_factor(speed), audio_offset_ms / 1000
    if model and sensor:
        raise InputError(
            f"--sensor: expected none beside --model, which carries its own, found {sensor}"
        )
    if model and fps is not None:
        raise InputError(f"--fps: expected none beside --model, which has its own, found {fps:g}")
    if model:
        paths = _demo(video, audio, quiet or as_json) if model == [Path(DEMO)] else model
        pipeline = LivePipeline.with_models([Network(path) for path in paths], offset_s)
        sources = open_sources(video, audio, pipeline.wanted, factor, exposure_ms)
    else:
        fps_hz = None if fps is None else rate_in(fps)
        images = images_of(video, load_sensor(sensor) if sensor else None, fps_hz)
        wanted = Wanted(sensor=images.sensor, fps_hz=fps_hz)
        sources = open_sources(video, audio, wanted, factor, exposure_ms, fps_hz)
        pipeline = LivePipeline.without_models(sources, images, offset_s)
    give_out(sources, pipeline, web=(host, port, token) if web else None, lsl=lsl, as_json=as_json)

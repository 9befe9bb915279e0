"""The command that feels live."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.shared import Quiet


def live(
    model: Annotated[
        list[Path] | None,
        typer.Option(
            help="ONNX file that 'export' wrote; may be repeated, to run several side by side "
            "(default: models of the simulated rig)."
        ),
    ] = None,
    video: Annotated[
        str | None,
        typer.Option(help="Source of images: camera:0, replay:SESSION/3/50, rig or rig:g/50."),
    ] = None,
    audio: Annotated[
        str | None,
        typer.Option(help="Source of sound: mic:default, replay:SESSION/3/50, rig or rig:g/50."),
    ] = None,
    speed: Annotated[
        str, typer.Option(help="How fast replays run: 1 as recorded, 8 times as fast, or max.")
    ] = "1",
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
        bool, typer.Option("--lsl", help="Also send percepts as streams of Lab Streaming Layer.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print percepts as JSON, one per line.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Classify texture while the fingertip slides.

    Runs exported models on a camera and a microphone, on a replayed recording, or on the simulated
    rig.
    """
    from afferents.commands.given import speed_factor
    from afferents.commands.live import models_for
    from afferents.live import Network, Perceiver, open_sources
    from afferents.live.outlets import give_out

    paths = model or models_for(video, audio, quiet or as_json)
    perceiver = Perceiver([Network(path) for path in paths], audio_offset_ms / 1000)
    sources = open_sources(video, audio, perceiver, speed_factor(speed), exposure_ms)
    give_out(sources, perceiver, web=(host, port, token) if web else None, lsl=lsl, as_json=as_json)

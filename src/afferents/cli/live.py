"""The command that feels live."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.shared import Quiet
from afferents.core.errors import InputError


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
        bool, typer.Option("--lsl", help="Also send percepts as streams of Lab Streaming Layer.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print percepts as JSON, one per line.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Look at what a fingertip senses, or classify texture while it slides.

    On a camera and a microphone, on a recording that is replayed, or on the simulated rig. Without
    a model it shows camera, markers, SA-I, RA-I, spectrum, and how good they are; with exported
    models it also says which texture they feel.
    """
    from afferents.commands.given import speed_factor
    from afferents.commands.live import Asked, feeling, looking
    from afferents.live.outlets import give_out

    asked = Asked(video, audio, speed_factor(speed), fps, exposure_ms, audio_offset_ms / 1000)
    if model and sensor:
        raise InputError("--sensor", "none beside --model, which carries its own", sensor)
    sources, senses = feeling(asked, model, quiet or as_json) if model else looking(asked, sensor)
    give_out(sources, senses, web=(host, port, token) if web else None, lsl=lsl, as_json=as_json)

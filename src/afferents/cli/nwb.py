"""The command that writes a store as an NWB file."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import SEED, Force, Json, Quiet


def export_nwb(
    store: Annotated[Path, typer.Argument(help="A store that 'extract' wrote.")],
    out: Annotated[Path, typer.Argument(help="File to write, such as session.nwb.")],
    session: Annotated[
        Path | None,
        typer.Option(
            help="Session folder that the store was extracted from, to name its videos in the file."
        ),
    ] = None,
    model: Annotated[
        str, typer.Option("--model", help="Of the spiking units: 'izhikevich' or 'lif'.")
    ] = "izhikevich",
    seed: Annotated[int, typer.Option(**SEED, help="Draws how units of a class differ.")] = 0,
    classes: Annotated[str, typer.Option(help="Classes of units, of SA,RA,PC.")] = "SA,RA,PC",
    sound: Annotated[
        bool, typer.Option("--sound/--no-sound", help="Whether the vibration is written too.")
    ] = True,
    markers: Annotated[
        bool,
        typer.Option("--markers/--no-markers", help="Whether the marker tracks are written too."),
    ] = True,
    start_time: Annotated[
        str | None,
        typer.Option(
            help="When the session began, such as 2026-03-31T09:30+02:00 (default: when the store "
            "was written)."
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a store as an NWB file: spikes of artificial afferents, trials, sound and markers.

    Recordings lie one after another on the session's clock.
    """
    from afferents import commands

    path = commands.export_nwb(
        store, out, session, model, seed, classes, sound, markers, start_time, force,
        quiet or as_json,
    )  # fmt: skip
    say(as_json, {"nwb": str(path)}, f"NWB: {path}")

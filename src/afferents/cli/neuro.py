"""Commands on spikes."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import SEED, Force, Json, Quiet


def neural(
    store: Annotated[Path, typer.Argument(help="Store that 'extract' wrote.")],
    out: Annotated[Path, typer.Option(help="Folder for tables and figures.")],
    units: Annotated[
        str,
        typer.Option(help="Model of a unit: izhikevich, or lif (leaky integrate-and-fire)."),
    ] = "izhikevich",
    classes: Annotated[
        str, typer.Option(help="Classes of afferents, some of SA, RA and PC.")
    ] = "SA,RA,PC",
    window_s: Annotated[
        float, typer.Option(min=0.01, help="Length of the stretches that texture is read from, s.")
    ] = 0.5,
    natural: Annotated[
        Path | None,
        typer.Option(
            help="Recordings of nerve fibres to compare with: a table of spikes (CSV, Parquet) or "
            "an NWB file."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Draws how units differ, and which are analysed.")
    ] = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn responses into spikes, and ask of them what is asked of nerve fibres.

    How often units fire, at which temporal resolution texture is read, and what speed does.
    """
    import afferents

    asked = tuple(name.strip() for name in classes.split(","))
    found = afferents.neural(store, out, units, seed, asked, window_s, natural, quiet or as_json)
    pictures = [f"Picture: {path}" for path in found.pictures]
    say(as_json, found.facts, *found.sentences, *pictures)


# The command that writes a store as an NWB file.


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
    import afferents

    path = afferents.export_nwb(
        store, out, session, model, seed, classes, sound, markers, start_time, force,
        quiet or as_json,
    )  # fmt: skip
    say(as_json, {"nwb": str(path)}, f"NWB: {path}")

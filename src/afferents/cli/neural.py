"""The command that asks spikes what the field asks of nerve fibres."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet


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
        typer.Option(help="TOML file that describes recordings of nerve fibres, to be put beside."),
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
    from afferents import commands

    asked = tuple(name.strip() for name in classes.split(","))
    found = commands.neural(store, out, units, seed, asked, window_s, natural, quiet or as_json)
    pictures = [f"Picture: {path}" for path in found.pictures]
    say(as_json, found.facts, *found.sentences, *pictures)

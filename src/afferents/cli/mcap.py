"""The command that writes recordings as ROS 2 bags in MCAP files."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet


def export_mcap(
    source: Annotated[Path, typer.Argument(help="A session, or a store that 'extract' wrote.")],
    out: Annotated[Path, typer.Argument(help="Folder to write; in it a bag for each recording.")],
    store: Annotated[
        Path | None,
        typer.Option(
            help="Store that was extracted from the session: its markers and responses are written "
            "beside the pictures."
        ),
    ] = None,
    recording: Annotated[
        list[str] | None,
        typer.Option(help="Name of a recording, such as 4/60 (default: all); may be repeated."),
    ] = None,
    quality: Annotated[
        int,
        typer.Option(help="Of JPEGs, 1 to 100, where the camera gave none; its own are kept."),
    ] = 95,
    percepts: Annotated[
        Path | None,
        typer.Option(help="What 'live --json' said of the one recording that is named."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write recordings as ROS 2 bags in MCAP files, for Foxglove, rerun and 'ros2 bag play'.

    No ROS is needed, but the extra mcap is.
    """
    from afferents import commands

    bags = commands.export_mcap(
        source, out, store, recording or (), quality, percepts, quiet or as_json
    )
    lines = [f"Bag: {bag}" for bag in bags[:3]]
    more = [f"and {len(bags) - 3} more in {out}"] if len(bags) > 3 else []
    say(as_json, {"bags": [str(bag) for bag in bags]}, *lines, *more)

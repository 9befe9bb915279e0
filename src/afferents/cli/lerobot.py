"""The command that writes a store as a LeRobot data set."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet


def export_lerobot(
    store: Annotated[Path, typer.Argument(help="A store that 'extract' wrote.")],
    out: Annotated[Path, typer.Argument(help="Folder to write.")],
    session: Annotated[
        Path | None,
        typer.Option(help="Session folder that the store was extracted from, for its videos."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a store as a LeRobot data set (format 3.0): an episode a recording.

    LeRobot itself is not needed.
    """
    from afferents import commands

    n = commands.export_lerobot(store, out, session, quiet or as_json)
    say(as_json, {"lerobot": str(out), "episodes": n}, f"LeRobot data set of {n} episodes: {out}")

"""The command that shows a recording in rerun's viewer."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json


def view(
    source: Annotated[Path, typer.Argument(help="A session, or a store that 'extract' wrote.")],
    recording: Annotated[
        str | None, typer.Argument(help="Its name, such as 4/60 (default: the first).")
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(help="Store that was extracted from the session: adds markers and responses."),
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option(help="File (.rrd) to write for 'rerun FILE', not the viewer."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Show a recording in rerun's viewer: camera, markers, SA-I, RA-I, sound and drum on one time.

    Needs the extra view.
    """
    from afferents import commands

    n = commands.view(source, recording, store, save)
    lines = [f"{entity}: {number}" for entity, number in n.items()]
    say(as_json, {"logged": n}, *lines, *([f"Written: {save}"] if save else []))

"""The command that brings public data sets here."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet


def fetch(
    name: Annotated[str, typer.Argument(help="Data set: pestell2022 or fabricslide.")],
    folder: Annotated[Path, typer.Argument(help="Folder that it goes into.")],
    url: Annotated[
        str | None,
        typer.Option(
            help="Another place where it is: a page or folder that lists its files, one archive "
            "of them, or what the paths of --manifest count from."
        ),
    ] = None,
    manifest: Annotated[
        Path | None,
        typer.Option(help="List of its files: PATH SHA-256 BYTES a line, or as sha256sum writes."),
    ] = None,
    keep_archive: Annotated[
        bool,
        typer.Option("--keep-archive", help="Keep a .zip or .tar of all of it, once unpacked."),
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fetch a public data set, with its size and licence said before it begins.

    Run it again to go on from where it was stopped.
    """
    from afferents import commands
    from afferents.pipeline.fetch import archive_named

    found = commands.fetch(name, folder, url, manifest, keep_archive, quiet or as_json)
    outcome = {**vars(found), "folder": str(found.folder)}
    then = archive_named(name).next_step.format(folder=folder)
    say(
        as_json,
        outcome,
        f"{found.fetched} files fetched, {found.kept} were here: {folder}",
        f"Next: {then}",
    )

"""The command that holds a store against the authors' own arrays and networks."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet
from afferents.cli.tables import TerminalTable


def compare(
    store: Annotated[Path, typer.Argument(help="Store that 'extract' wrote.")],
    authors: Annotated[
        Path,
        typer.Option(
            help="Folder of the authors' arrays and networks, as "
            "scripts/convert_authors_arrays.py writes it (pickles are never opened)."
        ),
    ],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show how far responses and networks are from the authors' own, at each stage.

    Compares tracks, SA-I, RA-I, spectra, and what the authors' trained networks say.
    """
    from afferents import commands

    found = commands.compare(store, authors, quiet or as_json)
    tables = [TerminalTable.of(table) for table in found.tables]
    say(as_json, found.facts, *tables, *found.sentences)

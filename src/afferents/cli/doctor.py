"""The command that looks at this machine."""

import typer
from rich.table import Table

from afferents.cli.printing import say
from afferents.cli.shared import Json


def doctor(as_json: Json = False) -> None:
    """Check this machine: versions, cores, accelerator, codecs, and what is missing."""
    from afferents.pipeline.doctor import diagnose

    rows, missing = diagnose()
    table = Table(show_header=False, box=None)
    for row in rows:
        table.add_row(*row)
    verdict = [f"Missing: {line}" for line in missing] or [
        "Nothing is missing that every command needs. The extras are for single commands."
    ]
    say(as_json, {"found": dict(rows), "missing": missing}, table, *verdict)
    if missing:
        raise typer.Exit(2)

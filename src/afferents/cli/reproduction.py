"""Commands that reproduce the paper, and look at this machine."""

from pathlib import Path
from textwrap import indent
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from afferents.choices import Like, Size
from afferents.cli.errors import fail_if_skipped
from afferents.cli.options import fields_of, of_encodings, options_of, shows, takes
from afferents.cli.printing import say
from afferents.cli.recordings import extract
from afferents.cli.shared import Json, Quiet
from afferents.documents import read_toml


def doctor(as_json: Json = False) -> None:
    """Check this machine: versions, cores, accelerator, codecs, and what is missing."""
    from afferents.doctor import diagnose

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


# Command of the whole way: from a session to its report.


def _list_discrepancies(wanted: bool) -> None:
    if wanted:
        from afferents.reporting.published import discrepancies

        say(False, None, discrepancies())
        raise typer.Exit


def _defaults() -> dict[str, str]:
    """Return what options are unless given, for their help."""
    presets = Path(__file__).parents[1] / "reproduction"
    ours, published = (
        read_toml(presets / f"{like}.toml", "options") for like in ("recommended", "published")
    )
    found = {}
    for name, theirs in published.items():
        own = ours.get(name, "as recordings say")
        found[name] = own if own == theirs else f"{own}, or {theirs} with --like published"
    return found


_DEFAULTS = _defaults()


@shows(
    "out", "session", "like", "size", "sensor", "models", "held_out", "workers", "discrepancies",
    "quiet",
)  # fmt: skip
@takes(
    options_of(extract, own=("session", "out", "as_json", "quiet"), values=_DEFAULTS),
    fields_of("EvaluationOptions", _DEFAULTS),
    of_encodings,
)
def reproduce(
    out: Annotated[
        Path, typer.Argument(help="Folder to write session, store, results and report to.")
    ],
    session: Annotated[
        Path | None, typer.Option(help="Session folder of your own (default: one is simulated).")
    ] = None,
    like: Annotated[
        Like,
        typer.Option(
            help="'published': tracker, cut, protocol and training as in the paper's code; "
            "'recommended': as we would do it. Any option given beside it overrules it."
        ),
    ] = "recommended",
    size: Annotated[
        Size,
        typer.Option(
            help="Length of the 130 simulated recordings: 8 s (quick), or the paper's 65 s (paper)."
        ),
    ] = "quick",
    discrepancies: Annotated[
        bool,
        typer.Option(
            "--discrepancies",
            callback=_list_discrepancies,
            is_eager=True,
            help="List where the paper's text and its code differ and what is done here, and end.",
        ),
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Run the paper's experiment from start to end: extract, evaluate, report.

    Prints first what is chosen, where that differs from the authors' code, and how much is to do.
    Without --like it evaluates the six models of Table 1 as we recommend, and ours beside them.
    """
    import afferents
    from afferents.reporting.summary_text import headline, next_steps, what_was_held_out
    from afferents.reporting.tables import short_table1

    results = afferents.reproduce(out, session, like, size, quiet or as_json, **options)
    page = results.root / "report.html"
    commands = [step.command for step in next_steps(results.found, results.root) if step.command]
    found = Text(headline(results.found))  # wrapped between words, as the caption above it
    said = ["", what_was_held_out(results.found), found, "", f"Report: {page.resolve()}"]
    if commands:
        said += ["Next:", indent(commands[-1], "  ")]
    say(as_json, results.summary, short_table1(results.found), *said)
    skipped = results.summary["skipped"]
    fail_if_skipped({entry["recording"]: entry["reason"] for entry in skipped})

"""Commands of evaluations: test models at held-out speeds, report, status."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from afferents.choices import Figures
from afferents.cli.errors import fail_if_skipped
from afferents.cli.options import fields_of, of_encodings, shows, takes
from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet
from afferents.models.model import TABLE1

if TYPE_CHECKING:
    import pandas as pd

    from afferents.evaluation.schemas import Summary


@shows(
    "data", "out", "models", "protocol", "preset", "split", "held_out", "seeds", "workers", "quiet"
)  # fmt: skip
@takes(fields_of("EvaluationOptions"), of_encodings)
def evaluate(
    data: Annotated[
        list[str],
        typer.Argument(help="Stores that 'extract' wrote, a dataset.toml, or fabricslide:PATH."),
    ],
    out: Annotated[
        Path, typer.Option(help="Results folder to write; folds that are finished in it are kept.")
    ],
    as_json: Json = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Train and test models on sliding speeds that they have not been trained on.

    Each speed is held out in turn (a fold): the model trains on the others and is tested on it.
    With --split it is each trial, or each value of another condition, instead of each speed.
    """
    import afferents

    given = {name: value for name, value in options.items() if value is not None}
    results = afferents.evaluate(data, out, quiet=quiet or as_json, **given)
    say(as_json, results.summary, *_tables(results.found), f"Results: {out}")
    fail_if_skipped({entry.recording: entry.reason for entry in results.found.skipped})


def report(
    results: Annotated[list[Path], typer.Argument(help="Results folders that 'evaluate' wrote.")],
    figures: Annotated[
        Figures,
        typer.Option(
            help="How the paper's figures are drawn: as suits what was evaluated ('report'), or "
            "as they are printed, 7 to 13 ('paper')."
        ),
    ] = "report",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a page (report.html) with tables and figures for each results folder.

    With several folders, their accuracies are also put side by side in one table.
    """
    import afferents
    from afferents.reporting.report import compare_runs

    table, written = compare_runs(results)  # which refuses some, before minutes of drawing
    pages = [afferents.report(folder, quiet or as_json, figures) for folder in results]
    found = {"reports": [str(page) for page in pages], "table": str(written)}
    lines = [f"Report: {page}" for page in pages]
    say(as_json, found, table, *lines, f"Table: {written}")


def status(
    results: Annotated[
        Path,
        typer.Argument(help="Folder that 'evaluate' or 'reproduce' writes, running or not."),
    ],
    as_json: Json = False,
) -> None:
    """Show how far an evaluation is, or a reproduction: done, running, failed, and when it ends."""
    from afferents.reporting.tables import make_table
    from afferents.reproduction.run_folder import STATES
    from afferents.reproduction.run_folder import status as look

    found = look(results)
    table = make_table("", "", ("model", "protocol", *STATES), found.rows, n_headers=2)
    say(as_json, found.facts, table, *found.sentences)


def _tables(summary: "Summary") -> list["pd.DataFrame"]:
    """Return Table 1 where some of its models were evaluated, and what our own came to."""
    from afferents.reporting.tables import (
        by_touch_table,
        lengths_table,
        short_table1,
        touches_table,
    )

    evaluated = set(summary.models)
    tables = [short_table1(summary)] if evaluated & set(TABLE1) else []
    tables += [touches_table(summary)] if evaluated - set(TABLE1) else []
    others = (lengths_table(summary), by_touch_table(summary))
    return tables + [table for table in others if table is not None]

"""What commands print on stdout: JSON for scripts, or lines and tables for people."""

import json
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from afferents.cli.errors import describe_full
from afferents.errors import AfferentsError

if TYPE_CHECKING:
    from pandas import DataFrame


def lay_out(table: "DataFrame", width: int) -> str:
    """Return a table as text; columns without a value are left out.

    Columns that don't fit into `width` characters follow below, with the headers of the rows.
    """
    from pandas import DataFrame

    from afferents.reporting.labels import ABSENT
    from afferents.reporting.tables import format_rows

    cells = [row[table.index.nlevels :] for row in format_rows(table)]
    rows = DataFrame(cells, table.index, table.columns)
    kept = rows.loc[:, (rows != ABSENT).any()]
    return kept.to_string(line_width=width).replace("\\\n", "\n")


def list_rows(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """Return a table of words for `say`.

    Parameters
    ----------
    heads
        Of the columns; no line of heads where all are empty. What the first one names stays whole;
        a cell of another that is too long goes on in its own column.
    """
    table = Table(
        title=title,
        title_style="bold",
        title_justify="left",
        show_header=any(heads),
        header_style="italic",
        box=None,
        pad_edge=False,
    )
    for place, head in enumerate(heads):
        table.add_column(head, overflow="fold", no_wrap=place == 0)
    for row in rows:
        table.add_row(*row)
    return table


def put_apart(tables: Iterable[Table]) -> Iterator[Table | str]:
    """Yield tables with an empty line after each."""
    for table in tables:
        yield from (table, "")


def say(as_json: bool, content: Any, *lines: Any) -> None:
    """Print the outcome of a command.

    Parameters
    ----------
    as_json
        Whether `content` is printed as JSON, and not the lines.
    lines
        Sentences, which are not wrapped, and tables of `list_rows` or `reporting.tables`.

    Raises
    ------
    AfferentsError
        If stdout is full.
    """
    console = Console(highlight=False, markup=False)
    try:
        if as_json:
            print(json.dumps(content, indent=2, default=str))  # noqa: T201
            lines = ()
        for line in lines:
            parts = [line]
            if hasattr(line, "attrs"):  # a table of `reporting.tables`
                rows = lay_out(line, console.width) if len(line) else ""
                title, caption = line.attrs["title"], line.attrs["caption"]
                parts = list(filter(None, [Text(title, "bold"), rows, Text(caption, "italic")]))
            for part in parts:
                console.print(part, soft_wrap=isinstance(part, str))
        sys.stdout.flush()
    except BrokenPipeError:
        raise  # who reads has heard enough
    except OSError as error:
        raise AfferentsError(describe_full(error)) from error


def once_a_kind(problems: Sequence[str]) -> list[str]:
    """Return the first of problems that differ in their files and numbers alone, and how many.

    Examples
    --------
    >>> once_a_kind(["3/50/video.mp4: found 30", "4/50/video.mp4: found 29.9", "no sound"])
    ['3/50/video.mp4: found 30 (and 1 more like it: --json has all)', 'no sound']
    """
    kinds: dict[str, list[str]] = {}
    for problem in problems:
        file, colon, rest = problem.partition(": ")
        kinds.setdefault(re.sub(r"\d+(\.\d+)?", "#", rest if colon else file), []).append(problem)
    return [
        first + (f" (and {len(others)} more like it: --json has all)" if others else "")
        for first, *others in kinds.values()
    ]

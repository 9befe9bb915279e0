"""What commands print on stdout: JSON for scripts, or lines and tables for people."""

import json
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console, JustifyMethod, RenderableType
from rich.table import Table
from rich.text import Text

from afferents.cli.errors import no_room
from afferents.errors import AfferentsError

if TYPE_CHECKING:
    from pandas import DataFrame

_BREAKS = r"(?<=:) | (?=\[)"
"""Where a value may be broken: after its name (`10 mm/s: 25.0`), before its interval."""
_PADDING, _EDGE = 3, 1
"""Characters beside each column, and what the edges of a table take beyond that."""


def lay_out(table: "DataFrame", width: int) -> Iterator[RenderableType]:
    """Yield what rich prints of a table in so many characters: title, columns, and caption.

    Where whole rows don't fit, columns without a value are left out, then values are broken; where
    that is not enough, columns are printed in several blocks, each with the headers of the rows. No
    word is broken.
    """
    from afferents.reporting.labels import ABSENT
    from afferents.reporting.tables import texts_of

    if table.attrs["title"]:
        yield Text(table.attrs["title"], style="bold")
    every, n_headers, rows = range(len(table.columns)), table.index.nlevels, list(texts_of(table))
    columns = [n for n in every if any(row[n_headers + n] != ABSENT for row in rows)] or [*every]
    if whole := _drawn(table, every, width, False) or _drawn(table, columns, width, False):
        yield whole
        columns = []
    while columns:
        n, block = next(
            (n, drawn)
            for n in range(len(columns), 0, -1)
            if (drawn := _drawn(table, columns[:n], width, broken=True))
        )
        yield block
        columns = columns[n:]
    if table.attrs["caption"]:
        yield Text(table.attrs["caption"], style="dim italic")


def _drawn(table: "DataFrame", columns: Sequence[int], width: int, broken: bool) -> Table | None:
    """Return a table of some columns, all but the headers of rows whole; None if it is too wide.

    One column alone is never too wide.
    """
    from afferents.reporting.tables import heads_of, texts_of

    n_headers = table.index.nlevels
    places = [*range(n_headers), *(n_headers + column for column in columns)]
    heads = [heads_of(table)[place] for place in places]
    rows = [[row[place] for place in places] for row in texts_of(table)]
    if broken:
        rows = [[*row[:n_headers], *(re.sub(_BREAKS, "\n", cell) for cell in row[n_headers:])]
                for row in rows]  # fmt: skip
    least, widths = [], []
    for number, head in enumerate(heads):
        is_header = number < n_headers
        cells = [row[number] for row in rows]
        pieces = [piece for cell in cells for piece in cell.split(None if is_header else "\n")]
        least.append(max(map(len, [*head.split(), *pieces]), default=0))
        widths.append(max([least[-1], *(len(cell) for cell in cells if is_header)]))
    spare = width - sum(one + _PADDING for one in widths) - _EDGE
    while spare < 0 and widths != least:
        widest = max(range(len(widths)), key=lambda number: widths[number] - least[number])
        widths[widest] -= 1
        spare += 1
    if spare < 0 and len(columns) > 1:
        return None
    for number, head in enumerate(heads):  # whole heads, from the left, as far as there is room
        more = len(head) - widths[number]
        if 0 < more <= spare:
            widths[number] += more
            spare -= more
    drawn = Table(box=box.SIMPLE_HEAD)
    for number, (head, one) in enumerate(zip(heads, widths, strict=True)):
        side: JustifyMethod = "left" if number < n_headers else "right"
        drawn.add_column(textwrap.fill(head, one), justify=side, width=one, overflow="fold")
    for row in rows:
        drawn.add_row(*(Text(cell, style="dim" if cell == "—" else "") for cell in row))
    return drawn


def say(as_json: bool, content: Any, *lines: Any) -> None:
    """Print the outcome of a command.

    Parameters
    ----------
    as_json
        Whether `content` is printed as JSON, and not the lines.
    lines
        Sentences, which are not wrapped, tables of `reporting.tables`, or of rich.

    Raises
    ------
    AfferentsError
        If stdout is full.
    """
    try:
        _print(as_json, content, lines)
        sys.stdout.flush()
    except BrokenPipeError:
        raise  # who reads has heard enough
    except OSError as error:
        raise AfferentsError(no_room(error)) from error


def _print(as_json: bool, content: Any, lines: Iterable[Any]) -> None:
    if as_json:
        print(json.dumps(content, indent=2, default=str))  # noqa: T201
        return
    console = Console(highlight=False, markup=False)
    for line in lines:
        parts = lay_out(line, console.width) if hasattr(line, "attrs") else [line]
        for part in parts:
            console.print(part, soft_wrap=isinstance(part, str))


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

"""What commands print on stdout: JSON for scripts, or lines and tables for people."""

import json
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from afferents.cli.errors import no_room
from afferents.errors import AfferentsError

if TYPE_CHECKING:
    from afferents.reporting.tables import Table

_BREAKS = r"(?<=:) | (?=\[)"
"""Where a value may be broken: after its name (`10 mm/s: 25.0`), before its interval."""
_PADDING, _EDGE = 3, 1
"""Characters beside each column, and what the edges of a table take beyond that."""


@dataclass(frozen=True)
class TerminalTable:
    """A table to print with rich.

    It is laid out for the terminal that it is printed in. Names break at spaces, values where
    `_BREAKS` says. If that is not enough, the columns are printed in several blocks, each with the
    cells that say what the row is.

    Attributes
    ----------
    columns
        Heads of the columns.
    rows
        Texts of the cells, as many as there are columns; those that are "—" are dimmed.
    n_headers
        How many cells of a row, from the left, say what the row is.
    title, caption
        Printed above and below, over the width of the terminal; empty for none.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    n_headers: int = 1
    title: str = ""
    caption: str = ""

    @classmethod
    def of(cls, table: "Table") -> "TerminalTable":
        """Return a table of the report for the terminal."""
        rows = [[cell.text for cell in row] for row in table.rows]
        return cls(table.columns, rows, table.n_headers, table.title, table.caption)

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        """Yield what rich prints."""
        available = options.max_width - _EDGE
        if self.title:
            yield Text(self.title, style="bold")
        for block in self._blocks(available):
            yield self._drawn(block, available)
        if self.caption:
            yield Text(self.caption, style="dim italic")

    def _blocks(self, available: int) -> list[list[int]]:
        """Return the columns of each block: the row's headers, and as many others as fit."""
        headers = list(range(self.n_headers))
        blocks, room = [[*headers]], available - _width(self._least(i) for i in headers)
        for column in range(self.n_headers, len(self.columns)):
            needed = _width([self._least(column)])
            if needed > room and len(blocks[-1]) > self.n_headers:
                blocks.append([*headers])
                room = available - _width(self._least(i) for i in headers)
            blocks[-1].append(column)
            room -= needed
        return blocks

    def _drawn(self, block: Sequence[int], available: int) -> RichTable:
        widths = self._widths(block, available)
        drawn = RichTable(box=box.SIMPLE_HEAD)
        for column, width in widths.items():
            side: JustifyMethod = "left" if column < self.n_headers else "right"
            head = _wrapped(self.columns[column].split(" "), width)
            drawn.add_column(head, justify=side, width=width, overflow="fold")
        for row in self.rows:
            cells = (_wrapped(self._pieces(row[c], c), width) for c, width in widths.items())
            drawn.add_row(*(Text(text, style="dim" if text == "—" else "") for text in cells))
        return drawn

    def _widths(self, block: Sequence[int], available: int) -> dict[int, int]:
        """Return the widths of columns: the least, then whole cells, then whole heads, if it fits.

        From left to right; what is left over goes to the names of rows.
        """
        widths = {column: self._least(column) for column in block}
        room = available - _width(widths.values())
        for whole in (self._longest_cell, lambda column: len(self.columns[column])):
            for column, width in widths.items():
                more = whole(column) - width
                if 0 < more <= room:
                    widths[column] += more
                    room -= more
        for column in range(self.n_headers):
            more = min(room, max(0, self._longest_cell(column) - widths[column]))
            widths[column] += more
            room -= more
        return widths

    def _least(self, column: int) -> int:
        """Return the length of the longest piece in a column."""
        cells = (piece for row in self.rows for piece in self._pieces(row[column], column))
        return max(map(len, [*self.columns[column].split(" "), *cells]))

    def _longest_cell(self, column: int) -> int:
        return max((len(row[column]) for row in self.rows), default=0)

    def _pieces(self, text: str, column: int) -> list[str]:
        """Return the parts of a cell between which its lines may be broken."""
        return text.split(" ") if column < self.n_headers else re.split(_BREAKS, text)


def _width(widths: Iterable[int]) -> int:
    return sum(width + _PADDING for width in widths)


def _wrapped(pieces: Sequence[str], width: int) -> str:
    """Return pieces in lines, each with as many as its width takes."""
    lines = [pieces[0]]
    for piece in pieces[1:]:
        if len(lines[-1]) + 1 + len(piece) <= width:
            lines[-1] += f" {piece}"
        else:
            lines.append(piece)
    return "\n".join(lines)


def say(as_json: bool, content: Any, *lines: Any) -> None:
    """Print the outcome of a command.

    Parameters
    ----------
    as_json
        Whether `content` is printed as JSON, and not the lines.
    lines
        Sentences, which are not wrapped, and tables of rich.

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
        console.print(line, soft_wrap=isinstance(line, str))


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

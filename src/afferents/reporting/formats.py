"""A `Table` as markdown and as a rich table; the page has its own template."""

from rich import box
from rich.table import Table as RichTable
from rich.text import Text

from afferents.reporting.table import Table


def to_markdown(table: Table) -> str:
    """Return the table as a markdown heading, pipe table and caption."""
    marks = ["---"] * table.n_headers + ["---:"] * (len(table.columns) - table.n_headers)
    lines = [list(table.columns), marks, *([cell.text for cell in row] for row in table.rows)]
    body = "\n".join(f"| {' | '.join(_escape(text) for text in line)} |" for line in lines)
    return f"### {table.title}\n\n{body}\n\n{table.caption}\n"


def to_rich(table: Table) -> RichTable:
    """Return the table for the terminal; cells with nothing in them are dimmed."""
    printed = RichTable(
        title=table.title,
        caption=table.caption,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        title_style="bold",
    )
    for index, column in enumerate(table.columns):
        printed.add_column(column, justify="left" if index < table.n_headers else "right")
    for row in table.rows:
        printed.add_row(*(Text(cell.text, style="dim" if cell.absent else "") for cell in row))
    return printed


def _escape(text: str) -> str:
    return text.replace("|", r"\|")

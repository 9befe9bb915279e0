"""A `Table` as markdown; the page has its own template, the command line its own layout."""

from afferents.reporting.table import Table


def to_markdown(table: Table) -> str:
    """Return the table as a markdown heading, pipe table and caption."""
    marks = ["---"] * table.n_headers + ["---:"] * (len(table.columns) - table.n_headers)
    lines = [list(table.columns), marks, *([cell.text for cell in row] for row in table.rows)]
    body = "\n".join(f"| {' | '.join(_escape(text) for text in line)} |" for line in lines)
    return f"### {table.title}\n\n{body}\n\n{table.caption}\n"


def _escape(text: str) -> str:
    return text.replace("|", r"\|")

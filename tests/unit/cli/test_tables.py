"""Tables in terminals of any width: all words are there, whole, and no line is too long."""

from io import StringIO

import pytest
from rich.console import Console

from afferents.cli.printing import lay_out
from afferents.reporting.tables import make_table

COLUMNS = ("Model", "Protocol", *(f"run-number-{n}" for n in range(4)), "Worst speed here")
VALUE, WORST = "50.1 [40.2, 60.3]", "10 mm/s: 25.0"
ROWS = [
    [name, protocol, *[VALUE] * 4, WORST]
    for name in ("RA-I vector waves", "vib-TE augmented")
    for protocol in ("nested protocol", "published protocol")
]
TITLE, CAPTION = "Accuracy at held-out speeds", "Percent of test samples."
TABLE = make_table(TITLE, CAPTION, COLUMNS, ROWS, 2)


def printed(table, width):
    console = Console(file=StringIO(), width=width, highlight=False, markup=False)
    console.print(*lay_out(table, console.width), sep="")
    return console.file.getvalue()


@pytest.mark.parametrize("width", [45, 60, 80, 100, 130, 160, 250])
def test_no_word_is_broken_and_none_is_lost(width):
    text = printed(TABLE, width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    words = text.split()
    for word in ("vector", "augmented", "published", "protocol", *COLUMNS[2:6]):
        assert word in words
    assert text.count("[40.2, 60.3]") == text.count("50.1") == 4 * len(ROWS)
    assert text.count("10 mm/s:") == text.count("25.0") == len(ROWS)


def test_a_line_for_each_row_or_columns_below_with_the_names_of_their_rows():
    lines = printed(TABLE, 160).splitlines()
    assert sum("50.1 [40.2, 60.3]   50.1 [40.2, 60.3]" in line for line in lines) == len(ROWS)
    heads = [line for line in printed(TABLE, 60).splitlines() if "Model" in line]
    assert len(heads) > 1
    assert all("Protocol" in head for head in heads)


def test_columns_without_a_value_are_left_out_where_there_is_no_room_for_them():
    rows = [["RA-I", VALUE, None, None, VALUE], ["vib-TE", VALUE, None, VALUE, VALUE]]
    table = make_table("", "", ("model", "at 0.1 s", "at 0.5 s", "at 1 s", "at 4 s"), rows)
    assert "0.5" in printed(table, 120)
    lines = printed(table, 75).splitlines()
    assert "0.5" not in "".join(lines)
    assert len([line for line in lines if "model" in line]) == 1


def test_what_is_not_there_and_markup_are_printed_as_they_stand():
    text = printed(make_table("", "", ("a", "b"), [["[bold]x", None]]), 40)
    assert "[bold]x" in text
    assert "—" in text
    assert printed(make_table("", "", ("a", "b"), []), 40).split() == ["a", "b", "─" * 7]

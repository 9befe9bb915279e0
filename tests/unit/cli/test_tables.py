"""Tables in terminals of any width: all words are there, whole, and no line is too long."""

import pytest

from afferents.cli.printing import lay_out, list_rows, say
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


@pytest.mark.parametrize("width", [60, 80, 100, 130, 160, 250])
def test_no_word_is_broken_and_none_is_lost(width):
    text = lay_out(TABLE, width)
    assert max(map(len, text.splitlines())) <= width
    assert "..." not in text
    words = text.split()
    for word in ("vector", "augmented", "published", "protocol", *COLUMNS[2:6]):
        assert word in words
    assert text.count("[40.2, 60.3]") == text.count("50.1") == 4 * len(ROWS)
    assert text.count("10 mm/s: 25.0") == len(ROWS)


def test_columns_follow_below_with_the_names_of_their_rows():
    assert lay_out(TABLE, 160).count("nested protocol") == 2
    assert lay_out(TABLE, 100).count("nested protocol") == 4


def test_columns_without_a_value_are_left_out():
    rows = [["RA-I", VALUE, None, None, VALUE], ["vib-TE", VALUE, None, VALUE, VALUE]]
    table = make_table("", "", ("model", "at 0.1 s", "at 0.5 s", "at 1 s", "at 4 s"), rows)
    assert "0.5" not in lay_out(table, 120)
    assert "—" in lay_out(table, 120)


def test_what_is_not_there_and_markup_are_printed_as_they_stand(capsys):
    rows = [["[bold]x", "1"], ["y", None]]
    say(False, None, make_table("Title", "Words.", ("a", "b"), rows))
    said = capsys.readouterr().out
    assert "[bold]x" in said
    assert "—" in said
    assert said.startswith("Title\n")
    assert said.endswith("Words.\n")
    say(False, None, make_table("", "", ("a", "b"), []))
    assert capsys.readouterr().out == ""


def test_words_go_on_in_their_column_and_names_stay_whole(capsys):
    name, words = "a-name-that-is-to-be-copied", "words of a cell " * 8
    say(False, None, list_rows("Title", ("Name", "What"), [(name, words), ("[b]", "markup")]))
    title, heads, *rows = capsys.readouterr().out.splitlines()
    assert (title.rstrip(), heads.split()) == ("Title", ["Name", "What"])
    assert rows[0].startswith(name)
    assert rows[-1].split() == ["[b]", "markup"]
    assert " ".join(row[len(name) :].strip() for row in rows[:-1]) == words.strip()
    assert max(map(len, rows)) <= 80

"""Logs beside a recording: what is written is read again, and nothing else is."""

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.store.drum_path import DRIVE, MARK, Drum, logged_path
from afferents.store.log import read_log, write_log

COLUMNS = {"time_s": float, "number": int, "lost": bool}
ROWS = [(0.1 + 0.2, 7, True), (float("nan"), 8, False), (1e6 / 3, 2**53 + 1, False)]
DRUM = '{"circumference_mm": 250, "contact_mm": 2, "zero": "mark"}'
WAY = f"""# {{"origin_s": 10.0, "rows": 3, "drum": {DRUM}}}
time_s,position_mm,fault
10.5,1.0,
11.0,nan,"over, current"
11.5,3.0,
"""


def test_numbers_are_read_as_they_were_written(tmp_path):
    write_log(tmp_path / "x.csv", (*COLUMNS, "note"), [(*row, None) for row in ROWS], 1 / 3)
    head, table = read_log(tmp_path / "x.csv", COLUMNS)
    assert (head.origin_s, head.rows, head.drum) == (1 / 3, 3, None)
    assert list(table) == list(COLUMNS)
    np.testing.assert_allclose(table.time_s, [row[0] for row in ROWS], rtol=1e-15)  # pandas 2
    assert [*zip(table.number, table.lost, strict=True)] == [row[1:] for row in ROWS]


def test_where_there_is_no_log_there_is_none(tmp_path):
    assert read_log(tmp_path / "x.csv", COLUMNS) is None


def test_the_way_is_that_of_the_log(tmp_path):
    (tmp_path / DRIVE).write_text(WAY)
    way = logged_path(tmp_path)
    assert way.drum == Drum(circumference_mm=250, contact_mm=2, zero=MARK)
    np.testing.assert_array_equal([way.time_s, way.position_mm], [[0.5, 1.5], [1.0, 3.0]])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (WAY, "", "found a damaged file, no JSON"),
        (WAY, "PAR1", "found a damaged file, no JSON"),
        ('"rows": 3, ', "", "the key 'rows', found none"),
        ("10.0,", '"noon",', "origin_s: a valid number, found 'noon'"),
        ("250", "-250", "circumference_mm: greater than 0, found -250"),
        ("position_mm", "position", "found the columns time_s, position, fault"),
        ("3.0", "three", "could not convert string to float: 'three'"),
        ("nan", "", "could not convert string to float: ''"),
        ("3.0,\n", "", "could not convert string to float: ''"),
        ("11.5,3.0,\n", "", "found 2 of its 3 rows"),
        ("3.0,", "3.0,,,", "Expected 3 fields in line 4, saw 5"),
        (WAY.split("\n", 1)[1], "time_s,position_mm\n1,2,3\n" + 2 * "4,5,6\n", "rows longer than"),
        ("11.5", "9.5", "times that rise, found some that go back"),
    ],
)
def test_a_log_that_is_not_whole_is_refused(tmp_path, old, new, said):
    assert old in WAY
    (tmp_path / DRIVE).write_text(WAY.replace(old, new))
    with pytest.raises(InputError, match=said) as refused:
        logged_path(tmp_path)
    assert str(refused.value).startswith(str(tmp_path / DRIVE))
    assert "\n" not in str(refused.value)

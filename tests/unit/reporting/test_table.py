"""Tables against hand-built results."""

from io import StringIO

import pytest
from rich.console import Console

from afferents.cli.printing import TerminalTable
from afferents.reporting.comparisons import by_touch_table, touches_table
from afferents.reporting.published import published_speeds, published_textures
from afferents.reporting.tables import (
    OTHER_RECORDINGS,
    SAME_GRID,
    accuracy_by_speed,
    leak_sentences,
    leak_table,
    mean_and_interval,
    run_table,
    table1,
    to_markdown,
)


def rows(table):
    return {row[0].text: [cell.text for cell in row[1:]] for row in table.rows}


def test_table1_has_the_six_families_with_the_papers_means_in_its_order(summary):
    table = table1(summary)
    assert [row[0].text for row in table.rows] == [
        "SA-SE",
        "RA-SE",
        "SA-STE",
        "RA-STE",
        "vib-TE",
        "vib-TE augmented",
    ]
    assert [row[1].text for row in table.rows] == ["46", "53", "46", "70", "50", "90"]


def test_table1_shows_mean_interval_and_worst_speed(summary):
    interval = "50.0 [40.2, 60.3]"
    assert rows(table1(summary))["vib-TE"] == ["50", interval, interval, "10 mm/s: 25.0"]


def test_table1_leaves_out_what_was_not_evaluated(summary):
    del summary["models"]["vib-te"]["nested"]
    found = rows(table1(summary))
    assert found["SA-SE"] == ["46", "—", "—", "—"]
    assert found["vib-TE"][1:] == ["—", "50.0 [40.2, 60.3]", "10 mm/s: 25.0"]


def test_table1_adds_models_that_the_paper_does_not_have(summary):
    summary["models"]["fusion"] = summary["models"]["vib-te"]
    assert rows(table1(summary))["fusion, late"][0] == "—"


def test_caption_says_that_other_recordings_are_no_reproduction(summary):
    assert OTHER_RECORDINGS in table1(summary).caption
    assert "no reproduction" in OTHER_RECORDINGS


@pytest.mark.parametrize(("simulated", "note"), [(False, SAME_GRID), (True, OTHER_RECORDINGS)])
def test_the_papers_grid_makes_its_column_comparable_only_if_recorded(summary, simulated, note):
    summary["textures"], summary["speeds_mm_s"] = list(published_textures()), published_speeds()
    summary["data"][0]["simulated"] = simulated
    assert note in table1(summary).caption


def test_interval_is_left_out_where_there_is_none():
    assert mean_and_interval({"mean_accuracy": 0.5, "ci95": None}) == "50.0"


def test_accuracy_by_speed_sets_the_paper_beside_ours_where_speeds_agree(summary):
    summary["speeds_mm_s"] = [10.0, 20.0, 40.0, 120.0]
    summary["textures"] = list(published_textures())
    table = accuracy_by_speed(summary)
    assert table.columns[2:] == ("10", "20", "40", "120")
    found = [[cell.text for cell in row] for row in table.rows[:3]]
    assert found == [
        ["vib-TE", "nested protocol", "25.0", "50.0", "75.0", "—"],
        ["vib-TE", "published protocol", "25.0", "50.0", "75.0", "—"],
        ["vib-TE", "paper", "16.8", "41.2", "51.5", "—"],
    ]
    assert table.rows[0][2].percent == pytest.approx(25)


def test_no_row_of_the_paper_where_no_speed_agrees_or_textures_are_others(summary):
    assert not any(row[1].text == "paper" for row in accuracy_by_speed(summary).rows)
    assert "paper" not in accuracy_by_speed(summary).caption
    summary["textures"] = list(published_textures())
    assert any(row[1].text == "paper" for row in accuracy_by_speed(summary).rows)
    summary["speeds_mm_s"] = [15.0, 25.0, 35.0]
    assert not any(row[1].text == "paper" for row in accuracy_by_speed(summary).rows)


def test_recordings_have_intervals_as_samples_have(summary):
    found = summary["models"]["vib-te"]["nested"]
    found["ci95_by_speed"] = {"10": [0.1, 0.4]}
    found["recordings"] = {**found, "mean_accuracy": 0.6, "ci95": [0.5, 0.7], "inside": None}
    table = touches_table(summary)
    by_unit = {row[2].text: [cell.text for cell in row[3:]] for row in table.rows[:2]}
    assert by_unit["a sample"] == ["50.0 [40.2, 60.3]", "—", "25.0 [10, 40]", "75.0"]
    assert by_unit["a recording"] == ["60.0 [50.0, 70.0]", "—", "25.0 [10, 40]", "75.0"]


@pytest.mark.parametrize(
    ("intervals", "said"),
    [
        (None, "recordings"),
        ({"replicate": "texture", "n": 3}, "3 textures, each with all its speeds"),
        ({"replicate": "session", "n": 5}, "5 sessions"),
    ],
)
def test_tables_say_what_intervals_were_drawn_over(summary, intervals, said):
    if intervals:
        summary["intervals"] = intervals
    for table in (table1(summary), touches_table(summary)):
        assert f"(over {said})" in table.caption


def test_leaks_are_named_and_added_over_the_models(summary):
    nested, published = leak_sentences(summary)
    assert "nothing of a held-out speed was seen" in nested
    assert published.startswith("Published protocol: 2,468 of 2,468 test samples are of a speed")
    assert "1,134 overlap validation" in published
    assert "scaling constants had seen" in published


def test_a_leak_under_nested_would_be_named_too(summary):
    summary["models"]["vib-te"]["nested"]["leaks"]["test_samples_overlapping_training"] = 7
    assert "7 overlap training" in leak_sentences(summary)[0]


def test_a_speed_that_was_trained_on_is_named(summary):
    leaks = summary["models"]["vib-te"]["nested"]["leaks"]
    leaks["test_samples_of_a_speed_seen_in_training"] = 1234
    assert "1,234 of one trained on" in leak_sentences(summary)[0]
    table = leak_table(summary)
    column = table.columns.index("… of a speed trained on")
    assert [row[column].text for row in table.rows[:2]] == ["1,234", "0"]


def test_leak_table_says_what_was_not_counted(summary):
    del summary["models"]["vib-te"]["nested"]["leaks"]["scale_saw_held_out_speed"]
    first = [cell.text for cell in leak_table(summary).rows[0]]
    assert first == ["vib-TE", "nested protocol", "1,234", "0", "0", "0", "0", "not counted"]
    assert leak_table(summary).rows[1][-1].text == "yes"


def test_run_table_names_what_validated(summary):
    nested, published = ([cell.text for cell in row] for row in run_table(summary).rows[:2])
    assert nested[2:5] == ["0.481", "0", "9 to 26"]
    assert nested[5] == "10 → 30, 20 → 40, 40 → 60"
    assert published[5] == "the held-out speed itself"


def test_markdown_has_a_line_a_row_and_the_caption(summary):
    lines = to_markdown(table1(summary)).splitlines()
    assert lines[2].count("|") == 6
    assert "| vib-TE | 50 | 50.0 [40.2, 60.3] | 50.0 [40.2, 60.3] | 10 mm/s: 25.0 |" in lines
    assert OTHER_RECORDINGS in lines[-1]


def test_a_terminal_shows_the_interval_and_does_not_take_it_for_markup(summary):
    console = Console(file=StringIO(), width=140)
    console.print(TerminalTable.of(table1(summary)))
    assert "50.0 [40.2, 60.3]" in console.file.getvalue()


def test_touches_of_equal_length_stand_side_by_side(summary):
    assert by_touch_table(summary) is None, "results of an earlier version"
    for found in summary["models"]["vib-te"].values():
        mine = {key: found[key] for key in ("mean_accuracy", "ci95", "by_speed", "worst_speed")}
        found["by_touch"] = {"0.11": None, "1": {**mine, "seconds": 1.0, "samples": 1}}
    table = by_touch_table(summary)
    assert table.columns[2:] == ("0.11 s", "worst, 0.11 s", "1 s", "worst, 1 s")
    assert [c.text for c in table.rows[0][2:]] == ["—", "—", "50.0 [40.2, 60.3]", "25.0"]

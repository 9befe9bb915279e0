"""Differences and runs side by side, against hand-built results."""

from copy import deepcopy

from afferents.reporting.comparisons import differences, runs_side_by_side
from afferents.reporting.tables import to_markdown


def rows(table):
    return {(row[0].text, row[1].text): [cell.text for cell in row[2:]] for row in table.rows}


def test_pairs_that_differ_in_one_thing_and_selection_are_shown(summary):
    ci95 = [-0.02, 0.123]
    summary["comparisons"] = [
        {"protocol": "nested", "model": m, "than": t, "difference": 0.05, "ci95": ci95}
        for m, t in [("vib-te-aug", "vib-te"), ("vib-te", "sa-se"), ("fusion", "vib-te")]
    ]
    summary["selection_effect"] = {"vib-te": {"difference": 0.3, "ci95": [0.21, 0.4]}}
    assert rows(differences(summary)) == {
        ("vib-TE augmented over vib-TE", "nested protocol"): ["+5.0 [-2.0, +12.3]"],
        ("fusion, late over vib-TE", "nested protocol"): ["+5.0 [-2.0, +12.3]"],
        ("vib-TE: what selection on the held-out speed adds", "published over nested"): [
            "+30.0 [+21.0, +40.0]"
        ],
    }


def test_both_protocols_of_a_pair_stand_together(summary):
    summary["comparisons"] = [
        {"protocol": p, "model": m, "than": "sa-se", "difference": 0.0, "ci95": [0, 0]}
        for p in ("nested", "published")
        for m in ("ra-se", "sa-ste")
    ]
    shown = [row[0].text for row in differences(summary).rows]
    assert shown == ["RA-SE over SA-SE"] * 2 + ["SA-STE over SA-SE"] * 2


def test_results_from_before_there_were_differences_have_none(summary):
    assert differences(summary) is None


def test_runs_stand_side_by_side_by_name(summary):
    other = deepcopy(summary)
    del other["models"]["vib-te-aug"]
    other["models"]["vib-te"]["nested"]["mean_accuracy"] = 0.75
    other["options"] = ["--train-speeds", "2"]
    table = runs_side_by_side({"all": summary, "two": other})
    assert table.columns == ("Model", "Protocol", "all", "two")
    found = rows(table)
    assert found["vib-TE", "nested protocol"] == ["50.0 [40.2, 60.3]", "75.0 [40.2, 60.3]"]
    assert found["vib-TE augmented", "nested protocol"] == ["50.0 [40.2, 60.3]", "—"]
    assert "two: 3 textures, 3 speeds, preset quick, --train-speeds 2" in table.caption
    assert "| all | two |" in to_markdown(table)

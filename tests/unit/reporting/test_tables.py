"""Tables against hand-built results."""

from copy import deepcopy

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from afferents.evaluation.results import Results
from afferents.evaluation.schemas import Summary, UnknownSummary
from afferents.reporting.comparisons import (
    LARGER,
    beside_paper,
    differences,
    likely,
    runs_side_by_side,
    spread_between_folds,
)
from afferents.reporting.confusion import label_edges
from afferents.reporting.labels import (
    are_published,
    source_line,
    spacing_note,
    texture_axis,
    texture_labels,
    texture_names,
    textures_line,
)
from afferents.reporting.published import (
    PublishedFamily,
    published_families,
    published_speeds,
    published_textures,
)
from afferents.reporting.tables import (
    OTHER_RECORDINGS,
    SAME_GRID,
    accuracy_by_speed,
    by_texture_table,
    by_touch_table,
    heads_of,
    leak_sentences,
    leak_table,
    reliability_table,
    run_table,
    table1,
    texts_of,
    to_markdown,
    touches_table,
)
from afferents.reporting.unseen import unknown_by_texture

TEXTURES, SPEEDS = list(published_textures()), list(published_speeds())
INTERVAL = "50.0 [40.2, 60.3]"
S = Summary.model_validate


def rows(table, n_headers=1):
    """Return the cells of rows by their headers."""
    key = (lambda row: row[0]) if n_headers == 1 else (lambda row: tuple(row[:n_headers]))
    return {key(row): row[n_headers:] for row in texts_of(table)}


def column(table, name):
    return [row[heads_of(table).index(name)] for row in texts_of(table)]


def caption(table):
    return table.attrs["caption"]


def set_speeds(summary, by_speed):
    """Let all models be tested at these speeds."""
    summary["speeds_mm_s"] = [float(key) for key in by_speed]
    for protocols in summary["models"].values():
        for found in protocols.values():
            intervals = {key: [0.0, 1.0] for key in by_speed}
            found |= {"by_speed": dict(by_speed), "ci95_by_speed": intervals}
            found["worst_speed"] = min(by_speed, key=by_speed.get)


def test_table1_has_the_papers_six_with_its_means_and_ours_in_its_order(summary):
    summary["models"]["fusion"] = summary["models"]["vib-te-aug"]
    del summary["models"]["vib-te"]["nested"]
    table = table1(S(summary))
    assert column(table, "Model") == [
        "SA-SE", "RA-SE", "SA-STE", "RA-STE", "vib-TE", "vib-TE augmented", "fusion, late",
    ]  # fmt: skip
    found = rows(table)
    assert [row[0] for row in found.values()] == ["46", "53", "46", "70", "50", "90", "—"]
    assert found["SA-SE"] == ["46", "—", "—", "—"]
    assert found["vib-TE"] == ["50", "—", INTERVAL, "10 mm/s: 25.0"]
    assert found["vib-TE augmented"] == ["90", INTERVAL, INTERVAL, "10 mm/s: 25.0"]


@pytest.mark.parametrize(("simulated", "note"), [(False, SAME_GRID), (True, OTHER_RECORDINGS)])
def test_the_papers_column_is_comparable_only_on_its_grid_if_recorded(summary, simulated, note):
    assert OTHER_RECORDINGS in caption(table1(S(summary)))
    summary["textures"], summary["speeds_mm_s"] = TEXTURES, SPEEDS
    summary["data"][0]["simulated"] = simulated
    assert note in caption(table1(S(summary)))


def test_missing_recordings_are_named(summary):
    summary["skipped"] = [{"recording": f"3/{n}", "reason": "x"} for n in range(7)]
    said = caption(table1(S(summary)))
    assert "7 recordings are missing: 3/0, 3/1, 3/2, 3/3, 3/4 and others." in said


def test_accuracy_by_speed_sets_the_paper_beside_ours_where_speeds_agree(summary):
    assert "paper" not in column(accuracy_by_speed(S(summary)), "Protocol")
    assert "paper" not in caption(accuracy_by_speed(S(summary)))
    summary["textures"] = TEXTURES
    set_speeds(summary, {"10": 0.25, "20": 0.5, "120": 0.75})
    table = accuracy_by_speed(S(summary))
    assert heads_of(table)[2:] == ["10", "20", "120"]
    assert texts_of(table)[:3] == [
        ["vib-TE", "nested", "25.0", "50.0", "75.0"],
        ["vib-TE", "published", "25.0", "50.0", "75.0"],
        ["vib-TE", "paper", "16.8", "41.2", "—"],
    ]
    assert table.iloc[0, 0] == pytest.approx(25)  # a number, for pages to shade
    set_speeds(summary, {"15": 0.25, "25": 0.5, "35": 0.75})
    assert "paper" not in column(accuracy_by_speed(S(summary)), "Protocol")


def test_recordings_have_intervals_as_samples_have(summary):
    summary["models"]["vib-te"]["nested"]["recordings"] |= {"mean_accuracy": 0.6, "inside": None}
    found = rows(touches_table(S(summary)), 3)
    at_ends = ["25.0 [15, 35]", "75.0 [65, 85]"]
    assert found["vib-TE", "nested", "a sample"] == [INTERVAL, "50.0 [30.0, 70.0]", *at_ends]
    assert found["vib-TE", "nested", "a recording"] == ["60.0 [40.2, 60.3]", "—", *at_ends]


@pytest.mark.parametrize(
    ("intervals", "said"),
    [
        ({"replicate": "texture", "n": 3}, "3 textures, each with all its speeds"),
        ({"replicate": "session", "n": 5}, "5 sessions"),
    ],
)
def test_tables_say_what_intervals_were_drawn_over(summary, intervals, said):
    summary["intervals"] = intervals
    for table in (table1(S(summary)), touches_table(S(summary)), by_touch_table(S(summary))):
        assert f"(over {said})" in caption(table)


def test_touches_of_equal_length_stand_side_by_side(summary):
    table = by_touch_table(S(summary))
    assert heads_of(table)[2:] == ["0.11 s", "worst, 0.11 s", "1 s", "worst, 1 s"]
    assert texts_of(table)[0][2:] == ["—", "—", INTERVAL, "25.0"]


def test_leaks_are_named_and_added_over_the_models(summary):
    leaks = summary["models"]["vib-te"]["nested"]["leaks"]
    nested, published = leak_sentences(S(summary))
    assert "nothing of a held-out speed was seen" in nested
    assert published.startswith("Published protocol: 2,468 of 2,468 test samples are of a speed")
    assert "1,134 overlap validation" in published
    assert "scaling constants had seen" in published
    leaks["test_samples_overlapping_training"] = 7  # under nested it would be named too
    leaks["test_samples_of_a_speed_seen_in_training"] = 1234
    assert "7 overlap training" in leak_sentences(S(summary))[0]
    assert "1,234 of one trained on" in leak_sentences(S(summary))[0]
    del leaks["scale_saw_held_out_speed"]
    first, second = texts_of(leak_table(S(summary)))[:2]
    assert first == ["vib-TE", "nested", "1,234", "1,234", "0", "0", "7", "not counted"]
    assert second[-1] == "yes"


def test_run_table_names_what_validated(summary):
    nested, published = texts_of(run_table(S(summary)))[:2]
    assert nested[2:6] == ["0.481", "0", "9 to 26", "10 → 30, 20 → 40, 40 → 60"]
    assert published[5] == "the held-out speed itself"


def test_reliability_is_said_in_percent(summary):
    bins = {"ece": 0.1, "count": [0, 30, 10], "confidence": [0, 0.5, 0.9], "accuracy": [0, 0.4, 1]}
    summary["models"]["vib-te"]["nested"]["reliability"] = bins
    summary["models"]["vib-te-aug"]["published"]["reliability"] = None
    table = reliability_table(S(summary))
    found = rows(table, 2)
    assert found["vib-TE", "nested"] == ["60.0", "55.0", "10.0"]
    assert found["vib-TE augmented", "published"] == ["—"] * 3
    assert "3 bins" in caption(table)


def test_markdown_has_a_line_a_row_and_the_caption(summary):
    lines = to_markdown(table1(S(summary))).splitlines()
    assert lines[2].count("|") == 6
    assert f"| vib-TE | 50 | {INTERVAL} | {INTERVAL} | 10 mm/s: 25.0 |" in lines
    assert OTHER_RECORDINGS in lines[-1]


# What compares.


def comparison(model, than, protocol="nested", difference=0.05):
    ci95 = [difference - 0.07, difference + 0.073]
    whose = {"protocol": protocol, "model": model, "than": than}
    return {**whose, "difference": difference, "ci95": ci95}


def test_pairs_that_differ_in_one_thing_and_selection_are_shown(summary):
    assert differences(S(summary)) is None
    pairs = [("vib-te-aug", "vib-te"), ("vib-te", "sa-se"), ("fusion", "vib-te")]
    summary["comparisons"] = [comparison(*pair) for pair in pairs]
    summary["selection_effect"] = {"vib-te": {"difference": 0.3, "ci95": [0.21, 0.4]}}
    assert rows(differences(S(summary)), 2) == {
        ("vib-TE augmented over vib-TE", "nested"): ["+5.0 [-2.0, +12.3]"],
        ("fusion, late over vib-TE", "nested"): ["+5.0 [-2.0, +12.3]"],
        ("vib-TE: what selection on the held-out speed adds", "published over nested"): [
            "+30.0 [+21.0, +40.0]"
        ],
    }


def test_both_protocols_of_a_pair_stand_together_and_seeds_are_named_where_there_are_several(
    summary,
):
    summary["comparisons"] = [
        comparison(model, "sa-se", protocol)
        for protocol in ("nested", "published")
        for model in ("ra-se", "sa-ste")
    ]
    table = differences(S(summary))
    assert column(table, "") == ["RA-SE over SA-SE"] * 2 + ["SA-STE over SA-SE"] * 2
    assert "seeds" not in caption(table)
    summary["models"]["vib-te"]["nested"]["seeds"] = [0, 1]
    assert "and over training seeds" in caption(differences(S(summary)))


def test_runs_stand_side_by_side_by_name(summary):
    other = deepcopy(summary)
    del other["models"]["vib-te-aug"]
    other["models"]["vib-te"]["nested"]["mean_accuracy"] = 0.75
    other["options"] = ["--train-speeds", "2"]
    table = runs_side_by_side({"all": S(summary), "two": S(other)})
    found = rows(table, 2)
    assert found["vib-TE", "nested"] == [INTERVAL, "75.0 [40.2, 60.3]"]
    assert found["vib-TE augmented", "nested"] == [INTERVAL, "—"]
    assert "two: 3 textures, 3 speeds, preset quick, --train-speeds 2" in caption(table)
    assert "| Model | Protocol | all | two |" in to_markdown(table)


@pytest.fixture
def of_paper(summary):
    """The paper's textures and speeds, each fold as it printed it but for one, 20 points above."""
    by_speed = {f"{v:g}": a / 100 for v, a in published_families()["ra-ste"].by_speed.items()}
    by_speed["30"] += 0.2
    outcome = {**summary["models"]["vib-te"]["published"], "seeds": [0, 1]}
    outcome["best_epoch"] = {key: [7, 9] for key in by_speed}
    first = [{"training": 0.3, "validation": 0.2}, {"training": 0.5, "validation": 0.4}]
    outcome["first_epoch"] = dict.fromkeys(by_speed, first)
    summary |= {"textures": TEXTURES, "models": {"ra-ste": {"published": outcome}}}
    summary["data"][0]["n_recordings"] = 130
    set_speeds(summary, by_speed)
    return summary


def test_spread_leaves_a_trend_out_and_finds_errors():
    def spread(accuracies):
        by_speed = dict(zip(map(float, range(10, 101, 10)), accuracies, strict=True))
        return spread_between_folds(PublishedFamily(50, by_speed, {}))

    trend, rng = np.linspace(20, 90, 10), np.random.default_rng(0)
    assert spread(trend) == pytest.approx(0)
    found = [spread(trend + rng.normal(0, 3, 10)) for _ in range(300)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(3, rel=0.06)


def test_twice_the_deviation_of_a_difference_is_likely():
    assert likely(2.8, 1.0)
    assert not likely(-2.9, 1.0)
    assert not likely(1.5, 1.0, n_folds=4)


def test_each_fold_stands_beside_the_papers(of_paper):
    table = beside_paper(S(of_paper))
    assert column(table, "Held out (mm/s)") == [*(f"{v:g}" for v in SPEEDS), "mean"]
    assert column(table, "Larger than likely") == ["", "", LARGER, *[""] * 7, LARGER]
    assert column(table, "Difference")[1:3] == ["+0.0", "+20.0"]
    assert column(table, "Best epoch: paper / here")[0] == "33 / 7, 9"
    assert column(table, "Epoch 1, training / validation: here")[0] == "40.0 / 30.0"
    of_log = published_families()["ra-ste"].folds[10.0]
    assert (of_log.best_epoch, of_log.percent) == (33, 35.2)


def test_of_one_speed_held_out_there_is_one_row_and_a_solved_model_has_no_epochs(of_paper):
    set_speeds(of_paper, {"50": 0.5})
    of_paper["models"]["ra-ste"]["published"] |= {"best_epoch": {}, "first_epoch": {}}
    table = beside_paper(S(of_paper))
    assert column(table, "Held out (mm/s)") == ["50"]
    assert column(table, "Epoch 1, training / validation: here") == ["—"]


@pytest.mark.parametrize("change", ["textures", "speeds", "models", "recordings"])
def test_others_than_the_papers_are_not_compared(of_paper, change):
    if change == "textures":
        of_paper["textures"] = TEXTURES[:-1]
    elif change == "speeds":
        set_speeds(of_paper, {"10": 0.5, "110": 0.5})
    elif change == "models":
        of_paper["models"] = {}
    else:  # folds that learnt from fewer speeds
        of_paper["data"][0]["n_recordings"] = 65
    assert beside_paper(S(of_paper)) is None


def test_accuracy_by_texture_is_a_mean_over_speeds(results):
    """Linen: at 10 mm/s one of four right, at 20 two, at 40 three; and none at one more speed."""
    more = results.predictions[results.predictions["held_out_speed_mm_s"] == 10].copy()
    more["held_out_speed_mm_s"] = 50.0
    more["predicted_texture"] = "0"
    everything = pd.concat([results.predictions, more, more])
    table = by_texture_table(Results(results.root, {}, results.found, everything))
    assert heads_of(table) == ["Model", "Protocol", "0", "0.5", "Linen"]
    assert texts_of(table)[0][2:] == ["62.5", "37.5", "37.5"]


def test_where_textures_are_the_papers_its_own_stand_beneath(of_paper):
    predictions = [
        ("ra-ste", "published", 0, 50.0, true, true if true in ("0", "6") else "0")
        for true in TEXTURES
    ]
    names = ["model", "protocol", "seed", "held_out_speed_mm_s", "true_texture"]
    table = pd.DataFrame(predictions, columns=[*names, "predicted_texture"])
    ours, paper = texts_of(by_texture_table(Results("OUT", {}, S(of_paper), table)))
    assert ours[-2:] == ["100.0", "0.0"]
    assert paper[-2:] == ["86.6", "67.2"]


# One name a texture: the paper's letters where all are of its series, else the session's own.


@pytest.mark.parametrize(
    ("textures", "names", "note"),
    [
        (TEXTURES, list("abcdefghijklm"), "a to m: bumps 0 to 6 mm apart"),
        (["0", "3", "6"], ["a", "g", "m"], "a, g, m: bumps 0, 3, 6 mm apart"),
        (["1", "1.5", "2", "2.5"], list("cdef"), "c to f: bumps 1 to 2.5 mm apart"),
        (["0", "3", "Linen"], ["0", "3", "Linen"], ""),
        (["0.7", "3"], ["0.7", "3"], ""),
    ],
)
def test_letters_only_where_all_textures_have_one(summary, textures, names, note):
    assert list(texture_names(textures, True).values()) == names
    assert spacing_note(S({**summary, "textures": textures})) == note


@pytest.mark.parametrize("textures", [TEXTURES, ["0", "1", "2", "3", "4", "5"]])
def test_where_nothing_says_that_they_are_spacings_numbers_are_names(summary, textures):
    """Somebody's own plates, 0 to 5, are no drums of the paper."""
    own = S({**summary, "textures": textures, "named_by_spacing": False})
    assert list(texture_names(textures, False).values()) == textures
    assert list(texture_labels(textures, False).values()) == textures
    assert spacing_note(own) == ""
    assert texture_axis(textures, False) == "texture"
    assert not are_published(own)
    assert textures_line(own) == f"{len(textures)}: {', '.join(textures)}"


def test_an_axis_says_what_numbers_mean_and_no_more():
    assert texture_axis(TEXTURES, True) == texture_axis(["Linen"], True) == "texture"
    assert texture_axis(["0.7", "3"], True) == "texture (bump spacing, mm)"
    assert texture_labels(["4"], True) == {"4": "i (4 mm)"}
    assert texture_labels(["4", "Linen"], True) == {"4": "4", "Linen": "Linen"}


def test_tables_figures_and_page_have_the_same_names(summary):
    summary["textures"] = TEXTURES
    assert are_published(S(summary))
    assert not are_published(S({**summary, "textures": TEXTURES[1:]}))
    assert "a to m: bumps 0 to 6 mm apart" in source_line(S(summary))
    assert textures_line(S(summary)).startswith("13: a, b, c, d")
    assert textures_line(S(summary)).count("mm") == 1
    table = unknown_by_texture(UnknownSummary.model_construct(**{**dict(S(summary)), "models": {}}))
    assert heads_of(table)[2:] == list("abcdefghijklm")
    assert caption(table).endswith("A to m: bumps 0 to 6 mm apart")


def test_ticks_of_a_confusion_matrix_are_these_names():
    for textures, names in ((["0", "0.5", "6"], ["a", "b", "m"]), (["0", "Linen"], ["0", "Linen"])):
        grid = Figure().subplots(1, 1, squeeze=False)
        label_edges(grid, textures, True)
        for labels in (grid[0, 0].get_xticklabels(), grid[0, 0].get_yticklabels()):
            assert [label.get_text() for label in labels] == names

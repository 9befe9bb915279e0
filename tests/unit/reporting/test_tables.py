"""Tables against hand-built results."""

import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.evaluation.results import Results, Summary
from afferents.reporting import compare, published, report, tables
from afferents.reporting.labels import are_published, caption, spacing_note, texture_names

TEXTURES, SPEEDS = list(published.published_textures()), list(published.published_speeds())
INTERVAL = "50.0 [40.2, 60.3]"
S = Summary.model_validate


def rows(table, n_headers=1):
    """Return the cells of rows by their headers."""
    key = (lambda row: row[0]) if n_headers == 1 else (lambda row: tuple(row[:n_headers]))
    return {key(row): row[n_headers:] for row in tables.format_rows(table)}


def column(table, name):
    return [row[tables.list_heads(table).index(name)] for row in tables.format_rows(table)]


def caption_of(table):
    return table.attrs["caption"]


def set_speeds(summary, by_speed):
    """Let all models be tested at these speeds."""
    summary["speeds_mm_s"] = [float(key) for key in by_speed]
    for protocols in summary["models"].values():
        for found in protocols.values():
            intervals = {key: [0.0, 1.0] for key in by_speed}
            found |= {"by": dict(by_speed), "ci95_by": intervals}
            found["worst"] = min(by_speed, key=by_speed.get)


def test_table1_has_the_papers_six_with_its_means_and_ours_in_its_order(summary):
    summary["models"]["fusion"] = summary["models"]["vib-te-aug"]
    del summary["models"]["vib-te"]["nested"]
    table = tables.table1(S(summary))
    assert column(table, "Model") == [
        "SA-SE", "RA-SE", "SA-STE", "RA-STE", "vib-TE", "vib-TE augmented", "fusion, late",
    ]  # fmt: skip
    found = rows(table)
    assert [row[0] for row in found.values()] == ["46", "53", "46", "70", "50", "90", "—"]
    assert found["SA-SE"] == ["46", "—", "—", "—"]
    assert found["vib-TE"] == ["50", "—", INTERVAL, "10 mm/s: 25.0"]
    assert found["vib-TE augmented"] == ["90", INTERVAL, INTERVAL, "10 mm/s: 25.0"]


def test_table1_of_other_data_has_only_the_rows_that_were_run(summary):
    summary["named_by_spacing"] = False
    assert column(tables.table1(S(summary)), "Model") == ["vib-TE", "vib-TE augmented"]


def test_a_ranking_across_modalities_has_the_papers_caution(summary):
    one = S(summary)
    ranked = [tables.table1(one), compare.compare_summaries({"one": one})]
    ranked[0:0] = [tables.table1(S({**summary, "named_by_spacing": False}))]
    assert [caption("across") in caption_of(table) for table in ranked] == [False, True, False]
    summary["models"]["sa-se"] = summary["models"]["vib-te"]
    one = S(summary)
    for table in (tables.table1(one), compare.compare_summaries({"one": one})):
        assert caption("across") in caption_of(table)
        assert "section 3.3.2" in caption_of(table)


@pytest.mark.parametrize(("simulated", "note"), [(False, "same_grid"), (True, "other_recordings")])
def test_the_papers_column_is_comparable_only_on_its_grid_and_what_is_missing_is_named(
    summary, simulated, note
):
    assert caption("other_recordings") in caption_of(tables.table1(S(summary)))
    summary["textures"], summary["speeds_mm_s"] = TEXTURES, SPEEDS
    summary["data"][0]["simulated"] = simulated
    summary["skipped"] = [{"recording": f"3/{n}", "reason": "x"} for n in range(7)]
    said = caption_of(tables.table1(S(summary)))
    assert caption(note) in said
    assert "7 recordings are missing: 3/0, 3/1, 3/2, 3/3, 3/4 and others." in said


def test_accuracy_by_speed_sets_the_paper_beside_ours_where_speeds_agree(summary):
    assert tables.PAPER_ROW not in column(tables.group_table(S(summary)), "Protocol")
    assert "paper" not in caption_of(tables.group_table(S(summary)))
    summary["textures"] = TEXTURES
    set_speeds(summary, {"10": 0.25, "20": 0.5, "120": 0.75})
    table = tables.group_table(S(summary))
    assert tables.list_heads(table)[2:] == ["10", "20", "120"]
    assert tables.format_rows(table)[:3] == [
        ["vib-TE", "nested", "25.0", "50.0", "75.0"],
        ["vib-TE", "published", "25.0", "50.0", "75.0"],
        ["vib-TE", tables.PAPER_ROW, "16.8", "41.2", "—"],
    ]
    assert table.iloc[0, 0] == pytest.approx(25)  # a number, for pages to shade
    set_speeds(summary, {"15": 0.25, "25": 0.5, "35": 0.75})
    assert tables.PAPER_ROW not in column(tables.group_table(S(summary)), "Protocol")


def test_recordings_have_intervals_as_samples_have(summary):
    summary["models"]["vib-te"]["nested"]["recordings"] |= {"mean_accuracy": 0.6, "inside": None}
    found = rows(tables.recordings_table(S(summary)), 3)
    at_ends = ["25.0 [15, 35]", "75.0 [65, 85]"]
    assert found["vib-TE", "nested", "a sample"] == [INTERVAL, "50.0 [30.0, 70.0]", *at_ends]
    assert found["vib-TE", "nested", "a recording"] == ["60.0 [40.2, 60.3]", "—", *at_ends]


def test_touches_of_equal_length_stand_side_by_side(summary):
    table = tables.touches_table(S(summary))
    assert tables.list_heads(table)[2:] == ["0.11 s", "worst, 0.11 s", "1 s", "worst, 1 s"]
    assert tables.format_rows(table)[0][2:] == ["—", "—", INTERVAL, "25.0"]


def test_leaks_are_named_and_added_over_the_models(summary):
    leaks = summary["models"]["vib-te"]["nested"]["leaks"]
    nested, published = tables.leak_sentences(S(summary))
    assert "nothing of a held-out speed was seen" in nested
    assert published.startswith("Published protocol: 2,468 of 2,468 test samples are of a speed")
    assert "1,134 overlap validation" in published
    assert "scaling constants had seen" in published
    leaks["test_samples_overlapping_training"] = 7  # under nested it would be named too
    leaks["test_samples_of_a_speed_seen_in_training"] = 1234
    assert "7 overlap training" in tables.leak_sentences(S(summary))[0]
    assert "1,234 of one trained on" in tables.leak_sentences(S(summary))[0]
    del leaks["scale_saw_held_out_speed"]
    first, second = tables.format_rows(tables.leak_table(S(summary)))[:2]
    assert first == ["vib-TE", "nested", "1,234", "1,234", "0", "0", "7", "not counted"]
    assert second[-1] == "yes"


def test_reliability_is_said_in_percent(summary):
    bins = {"ece": 0.1, "count": [0, 30, 10], "confidence": [0, 0.5, 0.9], "accuracy": [0, 0.4, 1]}
    summary["models"]["vib-te"]["nested"]["reliability"] = bins
    summary["models"]["vib-te-aug"]["published"]["reliability"] = None
    table = tables.confidence_table(S(summary))
    found = rows(table, 2)
    assert found["vib-TE", "nested"] == ["60.0", "55.0", "10.0"]
    assert found["vib-TE augmented", "published"] == ["—"] * 3
    assert "3 bins" in caption_of(table)


# What compares.


def comparison(model, than, protocol="nested", difference=0.05):
    ci95 = [difference - 0.07, difference + 0.073]
    whose = {"protocol": protocol, "model": model, "than": than}
    return {**whose, "difference": difference, "ci95": ci95}


def test_pairs_that_differ_in_one_thing_and_selection_are_shown(summary):
    assert compare.differences(S(summary)) is None
    pairs = [("fusion", "vib-te"), ("vib-te", "sa-se"), ("vib-te-aug", "vib-te")]
    summary["comparisons"] = [comparison(*pair) for pair in pairs]
    summary["selection_effect"] = {"vib-te": {"difference": 0.3, "ci95": [0.21, 0.4]}}
    shown = rows(compare.differences(S(summary)), 2)
    assert next(iter(shown)) == ("vib-TE augmented over vib-TE", "nested")
    assert shown == {
        ("vib-TE augmented over vib-TE", "nested"): ["+5.0 [-2.0, +12.3]"],
        ("fusion, late over vib-TE", "nested"): ["+5.0 [-2.0, +12.3]"],
        ("vib-TE: what the published protocol adds", "published over nested"): [
            "+30.0 [+21.0, +40.0]"
        ],
    }


@pytest.fixture
def of_paper(summary):
    """The paper's textures and speeds, each fold as it printed it but for one, 20 points above."""
    by_speed = {
        f"{v:g}": a / 100 for v, a in published.published_families()["ra-ste"].by_speed.items()
    }
    by_speed["30"] += 0.2
    outcome = {**summary["models"]["vib-te"]["published"], "seeds": [0, 1]}
    outcome["best_epoch"] = {key: [7, 9] for key in by_speed}
    first = [{"training": 0.3, "validation": 0.2}, {"training": 0.5, "validation": 0.4}]
    outcome["first_epoch"] = dict.fromkeys(by_speed, first)
    summary |= {"textures": TEXTURES, "models": {"ra-ste": {"published": outcome}}}
    summary["data"][0]["n_recordings"] = 130
    set_speeds(summary, by_speed)
    return summary


def test_each_fold_stands_beside_the_papers(of_paper):
    table = compare.compare_folds(S(of_paper))
    assert column(table, "Held out (mm/s)") == [*(f"{v:g}" for v in SPEEDS), "mean"]
    assert column(table, "Larger than likely") == [
        "",
        "",
        compare.LARGER,
        *[""] * 7,
        compare.LARGER,
    ]
    assert column(table, "Difference")[1:3] == ["+0.0", "+20.0"]
    assert column(table, "Best epoch: paper / here")[0] == "33 / 7, 9"
    assert column(table, "Epoch 1, training / validation: here")[0] == "40.0 / 30.0"
    of_log = published.published_families()["ra-ste"].folds[10.0]
    assert (of_log.best_epoch, of_log.percent) == (33, 35.2)
    set_speeds(of_paper, {"50": 0.5})
    assert column(compare.compare_folds(S(of_paper)), "Held out (mm/s)") == ["50"]


@pytest.mark.parametrize("change", ["textures", "speeds", "recordings", "options"])
def test_others_than_the_papers_are_not_compared(of_paper, change):
    if change == "textures":
        of_paper["textures"] = TEXTURES[:-1]
    elif change == "speeds":
        set_speeds(of_paper, {"10": 0.5, "110": 0.5})
    elif change == "options":
        of_paper["options"] = {"markers": 0.25}
    else:  # folds that learnt from fewer speeds
        of_paper["data"][0]["n_recordings"] = 65
    assert compare.compare_folds(S(of_paper)) is None


def test_runs_of_one_name_are_told_by_their_paths(results, monkeypatch, tmp_path):
    monkeypatch.setattr(report, "load_results", lambda folder: results)
    folders = [tmp_path / one / "results" for one in "ab"]
    folders[0].mkdir(parents=True)
    table, _ = report.compare_runs(folders)
    assert tables.list_heads(table)[2:] == [str(folder) for folder in folders]
    with pytest.raises(InputError, match="found one twice"):
        report.compare_runs(folders[:1] * 2)


def test_accuracy_by_texture_is_a_mean_over_speeds(results):
    """Linen: at 10 mm/s one of four right, at 20 two, at 40 three; and none at one more speed."""
    more = results.predictions[results.predictions["held_out_speed_mm_s"] == 10].copy()
    more["held_out_speed_mm_s"] = 50.0
    more["predicted_texture"] = "0"
    everything = pd.concat([results.predictions, more, more])
    table = tables.texture_table(Results(results.root, {}, results.found, everything))
    assert tables.list_heads(table) == ["Model", "Protocol", "0", "0.5", "Linen"]
    assert tables.format_rows(table)[0][2:] == ["62.5", "37.5", "37.5"]


def test_both_ends_of_the_series_are_recognised_better_by_sa1(results, summary):
    """As the paper writes of SA-I alone, and its matrices agree: 74.5 at the ends, 40.6 between."""
    shares = published.published_confusion("sa-se").diagonal()
    assert shares[[0, 12]].mean() == pytest.approx(74.5, abs=0.05)
    assert shares[1:12].mean() == pytest.approx(40.6, abs=0.05)
    summary |= {"textures": TEXTURES, "models": {"sa-se": summary["models"]["vib-te"]}}
    predictions = results.predictions.replace({"vib-te": "sa-se", "Linen": "6"})
    predictions = predictions[predictions["model"] == "sa-se"]
    table = tables.texture_table(Results(results.root, {}, S(summary), predictions))
    assert tables.format_rows(table)[-1][-2:] == ["74.5", "40.6"]
    assert "of SA-I alone that both ends of the series (a and m) are recognised" in caption_of(
        table
    )


# One name a texture: the paper's letters where all are of its series, else the session's own.


@pytest.mark.parametrize(
    ("textures", "by_spacing", "names", "note"),
    [
        (TEXTURES, True, list("abcdefghijklm"), "a: smooth; b to m: bumps 0.5 to 6 mm apart"),
        (["0", "3", "6"], True, ["a", "g", "m"], "a: smooth; g, m: bumps 3, 6 mm apart"),
        (["1", "1.5", "2", "2.5"], True, list("cdef"), "c to f: bumps 1 to 2.5 mm apart"),
        (["0", "3", "Linen"], True, ["0", "3", "Linen"], ""),
        (["0.7", "3"], True, ["0.7", "3"], ""),
        (TEXTURES, False, TEXTURES, ""),  # somebody's own plates are no drums of the paper
    ],
)
def test_letters_only_where_all_textures_have_one(summary, textures, by_spacing, names, note):
    found = S({**summary, "textures": textures, "named_by_spacing": by_spacing})
    assert list(texture_names(textures, by_spacing).values()) == names
    assert spacing_note(found) == note
    assert are_published(found) == (names == list("abcdefghijklm"))

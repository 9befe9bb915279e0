"""Our numbers beside the paper's: the rule for a difference, and when there is no comparison."""

import copy

import numpy as np
import pandas as pd
import pytest

from afferents.evaluation.results import Results
from afferents.reporting.accuracy_figures import by_texture_table
from afferents.reporting.comparisons import LARGER, beside_paper, likely, spread_between_folds
from afferents.reporting.published import (
    PublishedFamily,
    published_families,
    published_speeds,
    published_textures,
)

TEXTURES, SPEEDS = list(published_textures()), list(published_speeds())


def family(accuracies):
    by_speed = dict(zip(map(float, range(10, 101, 10)), accuracies, strict=True))
    return PublishedFamily(50, by_speed, {})


@pytest.fixture
def of_paper(summary):
    """The paper's textures and speeds, each fold as it printed it but for one, 20 points above."""
    by_speed = {f"{v:g}": a / 100 for v, a in published_families()["ra-ste"].by_speed.items()}
    by_speed["30"] += 0.2
    outcome = {**summary["models"]["vib-te"]["published"], "by_speed": by_speed, "seeds": [0, 1]}
    outcome["best_epoch"] = {key: [7, 9] for key in by_speed}
    first = [{"training": 0.3, "validation": 0.2}, {"training": 0.5, "validation": 0.4}]
    outcome["first_epoch"] = dict.fromkeys(by_speed, first)
    summary |= {"textures": TEXTURES, "speeds_mm_s": SPEEDS}
    summary["data"][0]["n_recordings"] = 130
    summary["models"] = {"ra-ste": {"published": outcome}}
    return summary


def column(table, name):
    return [row[table.columns.index(name)].text for row in table.rows]


def test_spread_leaves_a_trend_out_and_finds_errors():
    assert spread_between_folds(family(np.linspace(20, 90, 10))) == pytest.approx(0)
    rng = np.random.default_rng(0)
    found = [
        spread_between_folds(family(np.linspace(20, 90, 10) + rng.normal(0, 3, 10)))
        for _ in range(300)
    ]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(3, rel=0.06)


def test_twice_the_deviation_of_a_difference_is_likely():
    assert likely(2.8, 1.0)
    assert not likely(-2.9, 1.0)
    assert not likely(1.5, 1.0, n_folds=4)


def test_each_fold_stands_beside_the_papers(of_paper):
    table = beside_paper(of_paper)
    assert column(table, "Held out (mm/s)") == [*(f"{v:g}" for v in SPEEDS), "mean"]
    assert column(table, "Larger than likely") == ["", "", LARGER, *[""] * 7, LARGER]
    assert column(table, "Difference")[1:3] == ["+0.0", "+20.0"]
    assert column(table, "Best epoch: paper / here")[0] == "33 / 7, 9"
    assert column(table, "Epoch 1, training / validation: here")[0] == "40.0 / 30.0"
    of_log = published_families()["ra-ste"].folds[10.0]
    assert (of_log.best_epoch, of_log.percent) == (33, 35.2)


def test_of_one_speed_held_out_there_is_one_row(of_paper):
    found = of_paper["models"]["ra-ste"]["published"]
    of_paper["speeds_mm_s"], found["by_speed"] = [50.0], {"50": found["by_speed"]["50"]}
    assert column(beside_paper(of_paper), "Held out (mm/s)") == ["50"]


def test_earlier_results_do_not_say_how_trainings_went(of_paper):
    found = of_paper["models"]["ra-ste"]["published"]
    del found["best_epoch"], found["first_epoch"]
    table = beside_paper(of_paper)
    assert column(table, "Best epoch: paper / here")[0] == "33 / —"
    assert column(table, "Epoch 1, training / validation: here")[0] == "—"


@pytest.mark.parametrize(
    "change",
    [
        {"textures": TEXTURES[:-1]},
        {"speeds_mm_s": [*SPEEDS, 110.0]},
        {"models": {}},
        {"split": "trial", "groups": ["1", "2"]},
    ],
)
def test_others_than_the_papers_are_not_compared(of_paper, change):
    assert beside_paper(of_paper | change) is None


def test_folds_that_learnt_from_fewer_speeds_are_not_compared(of_paper):
    of_paper["data"][0]["n_recordings"] = 65
    assert beside_paper(of_paper) is None


def test_accuracy_by_texture_is_a_mean_over_speeds(results):
    """Linen: at 10 mm/s one of four right, at 20 two, at 40 three; and none at one more speed."""
    more = results.predictions[results.predictions["held_out_speed_mm_s"] == 10].copy()
    more["held_out_speed_mm_s"] = 50.0
    more["predicted_texture"] = "0"
    everything = pd.concat([results.predictions, more, more])
    results = Results(results.root, results.config, results.summary, everything)
    table = by_texture_table(results)
    assert table.columns == ("Model", "Protocol", "0", "0.5", "Linen")
    assert [cell.text for cell in table.rows[0][2:]] == ["62.5", "37.5", "37.5"]


def test_where_textures_are_the_papers_its_own_stand_beneath(of_paper):
    rows = [
        ("ra-ste", "published", 0, 50.0, true, true if true in ("0", "6") else "0")
        for true in TEXTURES
    ]
    names = ["model", "protocol", "seed", "held_out_speed_mm_s", "true_texture"]
    table = pd.DataFrame(rows, columns=[*names, "predicted_texture"])
    ours, paper = by_texture_table(Results("OUT", {}, copy.deepcopy(of_paper), table)).rows
    assert [cell.text for cell in ours[-2:]] == ["100.0", "0.0"]
    assert [cell.text for cell in paper[-2:]] == ["86.6", "67.2"]

"""A recording is named by all of its samples; the ends of the speeds stand apart."""

import numpy as np
import pandas as pd

from afferents.evaluation.touches import inside_speeds, name_recordings


def predictions(rows):
    table = pd.DataFrame(
        rows, columns=["held_out_speed_mm_s", "recording", "true_texture", "p_a", "p_b"]
    )
    return table.assign(seed=0, predicted_texture=np.where(table.p_a > table.p_b, "a", "b"))


def test_one_sure_sample_outweighs_two_that_waver():
    table = predictions(
        [(10, "r", "a", 0.99, 0.01), (10, "r", "a", 0.4, 0.6), (10, "r", "a", 0.4, 0.6)]
    )
    named = name_recordings(table, ["a", "b"])
    assert list(named["predicted_texture"]) == ["a"]
    assert list(named["true_texture"]) == ["a"]


def test_recordings_seeds_and_speeds_are_kept_apart():
    table = predictions([(v, f"{v}/{r}", "a", 0.9, 0.1) for v in (10, 20) for r in "xyz"])
    both = pd.concat([table, table.assign(seed=1)])
    assert len(name_recordings(both, ["a", "b"])) == 12


def test_a_probability_of_zero_is_no_infinity():
    named = name_recordings(predictions([(10, "r", "b", 0.0, 1.0)]), ["a", "b"])
    assert list(named["predicted_texture"]) == ["b"]


def test_between_leaves_out_slowest_and_fastest():
    table = predictions([(v, "r", "a", 1, 0) for v in (10, 20, 30, 40)])
    assert sorted(inside_speeds(table)["held_out_speed_mm_s"]) == [20, 30]

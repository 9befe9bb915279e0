import pandas as pd
import pytest

from afferents.evaluation.unknown import auroc, recordings_of, summarise_unknown


def table():
    """Two textures at three speeds; `b` is found at 10 and 20 mm/s, `a` at none."""
    rows = [
        (v, left_out, texture, f"{texture}/{v}", novelty, 1.0)
        for v in (10.0, 20.0, 30.0)
        for left_out in ("a", "b")
        for texture in ("a", "b")
        for novelty in ((2.0, 1.4) if left_out == texture == "b" and v < 30 else (0.9, 0.5))
    ]
    names = ["held_out_speed_mm_s", "left_out", "texture", "recording", "novelty"]
    return pd.DataFrame(rows, columns=[*names, "recordings_limit"])


def test_by_hand():
    found = summarise_unknown(table()).content()
    assert found["found"]["samples"]["mean"] == pytest.approx(1 / 3)
    assert found["found"]["samples"]["by_speed"] == {"10": 0.5, "20": 0.5, "30": 0}
    assert found["found"]["recordings"]["inside"]["mean"] == 0.5
    assert found["false_alarms"]["samples"] == {
        "mean": 0, "ci95": [0, 0], "inside": {"mean": 0, "ci95": [0, 0]},
        "outside": {"mean": 0, "ci95": [0, 0]},
        "by_speed": {"10": 0, "20": 0, "30": 0},
    }  # fmt: skip
    # b is told from a in each pair at two speeds; all else is as strange as the other.
    assert found["auroc"]["samples"] == pytest.approx((2 * 1 + 4 * 0.5) / 6)
    assert found["auroc_inside"]["samples"] == pytest.approx((1 + 0.5) / 2)
    assert found["by_texture"]["b"]["found_samples"] == pytest.approx(2 / 3)
    assert found["by_texture"]["a"] == {
        "found_samples": 0, "found_recordings": 0, "false_alarms": 0, "auroc": 0.5,
    }  # fmt: skip
    assert found["n"] == 12


def test_a_recording_is_judged_by_the_mean_of_its_samples_and_its_own_limit():
    mine = table()[lambda t: (t.left_out == "b") & (t.texture == "b")]
    rows = recordings_of(mine.assign(recordings_limit=1.7))
    assert rows["novelty"].tolist() == pytest.approx([1, 1, 0.7 / 1.7])


def test_area_counts_pairs():
    rows = pd.DataFrame(
        {"left_out": "a", "texture": ["a", "a", "b", "b"], "novelty": [3.0, 1.0, 2.0, 0.0]}
    )
    assert auroc(rows) == 0.75


def test_speeds_outside_what_was_learnt_stand_apart():
    rows = table()
    slow = (rows["held_out_speed_mm_s"] == 10.0) & (rows["left_out"] != rows["texture"])
    found = summarise_unknown(rows.assign(novelty=rows["novelty"].mask(slow, 5.0))).content()
    alarms = found["false_alarms"]["samples"]
    assert (alarms["inside"]["mean"], alarms["outside"]["mean"]) == (0, 0.5)
    # At 10 mm/s all that was felt is more novel than what was not; at 30 all are the same.
    assert found["auroc_outside"]["samples"] == pytest.approx((0 + 0 + 0.5 + 0.5) / 4)
    assert found["auroc_inside"]["samples"] == pytest.approx((1 + 0.5) / 2)

"""Plans: every run once, in an order that a person can follow; what is wrong is one sentence."""

from itertools import pairwise

import pytest

from afferents.errors import InputError
from afferents.lab.recorder.plan import EXAMPLE, read_plan

PLAN = """
textures = ["2", "linen", "4"]
speeds_mm_s = [20, 40]
repetitions = 2
seconds = 1
[camera]
kind = "v4l2"
"""


def plan_of(tmp_path, text=PLAN):
    path = tmp_path / "PLAN.toml"
    path.write_text(text)
    return read_plan(path)


def test_every_run_once_and_all_of_a_drum_in_a_row(tmp_path):
    plan = plan_of(tmp_path)
    names = [entry.name for entry in plan.entries()]
    assert len(set(names)) == len(names) == 3 * 2 * 2
    assert {"linen/20/1", "4/40/2"} < set(names)
    drums = [entry.texture for entry in plan.entries()]
    assert sum(a != b for a, b in pairwise(drums)) == 2


def test_the_order_is_the_seeds(tmp_path):
    orders = {
        seed: [e.name for e in plan_of(tmp_path, f"seed = {seed}\n{PLAN}").entries()]
        for seed in range(4)
    }
    assert plan_of(tmp_path).entries()[0].name == orders[0][0]
    assert len({tuple(order) for order in orders.values()}) == 4


def test_a_sweep_is_recorded_so_often_in_all_and_its_runs_name_no_speed(tmp_path):
    plan = plan_of(tmp_path, f"sweep = true\n{PLAN}")
    assert {e.name for e in plan.entries() if e.texture == "4"} == {"4/sweep/1", "4/sweep/2"}
    assert {entry.speed_mm_s for entry in plan.entries()} == {30.0}
    with pytest.raises(InputError, match="with sweep, two speeds_mm_s"):
        plan_of(tmp_path, f"sweep = true\n{PLAN}".replace("[20, 40]", "[20]"))
    assert "sweep" not in plan_of(tmp_path).model_dump()  # so earlier sessions go on


def test_the_example_is_a_plan(tmp_path):
    assert plan_of(tmp_path, EXAMPLE.read_text()).total_s == 6.5


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('"linen"', '"../linen"', "names that folders may have"),
        ('"linen"', '"2.0"', "each texture under one name"),
        ('"linen"', '"2"', "each texture and each speed once"),
        ("[20, 40]", "[20, -40]", r"speeds_mm_s.1: greater than 0, found -40"),
        ("seconds = 1", "seconds = 1\ntap_s = 3", r"with tap_s, a \[microphone\]"),
        ("seconds = 1", "seconds = 1\nspeed = 3", "unknown key 'speed'"),
    ],
)
def test_what_is_wrong_is_said_before_anything_moves(tmp_path, before, after, said):
    with pytest.raises(InputError, match=said):
        plan_of(tmp_path, PLAN.replace(before, after))

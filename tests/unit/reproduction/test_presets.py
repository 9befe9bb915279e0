"""What `reproduce` chooses, and what is asked for otherwise."""

from typing import get_args

from afferents import choices
from afferents.choices import Cut
from afferents.folds.protocol import PROTOCOLS
from afferents.reproduction.presets import CHOICES, choose, list_changes

MAY_BE = {
    "method": get_args(choices.Method),
    "rest": get_args(choices.Rest),
    "fps_hz": (None, 90.0),
    "cut": get_args(Cut),
    "protocol": tuple(PROTOCOLS),
    "models": ("all", "best,all"),
    "preset": get_args(choices.Preset),
    "statistics": get_args(choices.Statistics),
    "precision": get_args(choices.Precision),
}


def test_every_choice_is_a_value_that_its_option_takes():
    assert {one.name for one in CHOICES} == set(MAY_BE)
    for one in CHOICES:
        assert {one.recommended, one.published} <= set(MAY_BE[one.name])


def test_what_is_given_overrules_and_is_named():
    given = {"cut": "all", "preset": "paper", "workers": 3}
    assert choose("published", given) == {
        "method": "published", "rest": "own", "fps_hz": 90.0, "cut": "all", "protocol": "published",
        "models": "all", "preset": "paper", "statistics": "keras", "precision": "float32",
    }  # fmt: skip
    assert list_changes("published", given) == ["--cut all (published: published)"]
    assert list_changes("recommended", given, ["--held-out 50"]) == [
        "--preset paper (recommended: fast)",
        "--held-out 50",
    ]

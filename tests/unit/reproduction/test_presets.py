"""The packaged options of `reproduce`, and what is named where others are given."""

from inspect import signature

import afferents
from afferents.evaluation.options import EvaluationOptions
from afferents.reproduction.reproduce import EXTRACTING, list_changes, read_preset


def test_the_packaged_files_hold_options_of_extract_and_evaluate():
    for like in ("published", "recommended"):
        assert set(read_preset(like)) <= EXTRACTING | set(EvaluationOptions.model_fields)


def test_what_we_recommend_is_what_commands_do_unless_told():
    recommended, usual = read_preset("recommended"), signature(afferents.extract).parameters
    extracting = {name: v for name, v in recommended.items() if name in EXTRACTING}
    assert extracting == {name: usual[name].default for name in extracting}
    evaluating = {name: v for name, v in recommended.items() if name not in EXTRACTING}
    assert EvaluationOptions(**evaluating) == EvaluationOptions()


def test_what_is_given_otherwise_is_named():
    given = {"cut": "all", "preset": "paper", "models": ["all"], "fps_hz": 90.0, "workers": 3}
    assert list_changes("published", given) == ["cut = all (published: published)"]
    assert list_changes("recommended", {**given, "held_out": "50"}) == [
        "preset = paper (recommended: fast)",
        "models = all (recommended: best,all)",
        "fps_hz = 90",
        "held_out = 50",
    ]

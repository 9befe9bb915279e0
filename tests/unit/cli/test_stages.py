"""Options that commands take from elsewhere: which are shown, and how they are given."""

import json
import re

import pytest

from afferents import load_results
from afferents.choices import flag_of
from afferents.cli.program import read_given
from afferents.evaluation.options import EvaluationOptions, TrainingOptions


def listed(does, *command):
    """Return the flags that help lists."""
    out = does(*command)
    return re.findall(r"^│ [* ]*(--[\w-]+) ", out, re.MULTILINE)


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")


@pytest.mark.parametrize("command", ["evaluate", "train", "reproduce", "simulate"])
def test_help_lists_twelve_options_at_most_and_all_on_demand(does, command):
    few, every = listed(does, command, "--help"), listed(does, command, "--help-all")
    assert len(set(few) - {"--help"}) <= 13
    assert {"--config", "--help-all"} <= set(few) < set(every)


@pytest.mark.parametrize(
    ("command", "fields"), [("evaluate", EvaluationOptions), ("train", TrainingOptions)]
)
def test_every_field_is_an_option(does, command, fields):
    assert {flag_of(name) for name in fields.model_fields} <= set(
        listed(does, command, "--help-all")
    )


def test_reproduce_has_the_options_of_its_stages(does):
    every = set(listed(does, "reproduce", "--help-all"))
    for stage in ("extract", "evaluate"):
        assert set(listed(does, stage, "--help-all" if stage == "evaluate" else "--help")) - {
            "--out", "--force"
        } <= every | {"--out"}  # fmt: skip


def test_a_file_gives_options_by_name_and_flags_overrule_it(does, stores, tmp_path):
    """The configuration of a results folder repeats a run."""
    file = tmp_path / "mine.toml"
    file.write_text(
        'models = "order-te"\nheld_out = [20, 40]\nwindow-s = 0.5\nspeeds = "20,30,40"\n'
        "[disturb]\nsound = 0.1\n"
    )
    store, out = stores["audio"], tmp_path / "r"
    told = ("--config", file, "--held-out", 30, "--workers", 1, "--json")
    printed = does("evaluate", store, "--out", out, *told, "--seed", 1)
    summary = json.loads(printed)
    assert summary["speeds_mm_s"] == [30.0]
    assert summary["models"]["order-te"]["nested"]["seeds"] == [1]
    assert summary["disturb"] == {"sound": 0.1}
    assert summary["options"] == {
        "speeds": [20, 30, 40], "held_out": [30], "disturb": {"sound": 0.1}, "window_s": 0.5,
    }  # fmt: skip
    again = ("evaluate", "--config", out / "config.json", "--out", tmp_path / "s", "--json")
    does(*again)
    first, second = (json.loads((at / "config.json").read_text()) for at in (out, tmp_path / "s"))
    assert first == second
    assert load_results(out).predictions.equals(load_results(tmp_path / "s").predictions)


def test_a_file_in_json_names_data_by_their_paths(run, tmp_path):
    file, store = tmp_path / "mine.json", tmp_path / "none.zarr"
    file.write_text(json.dumps({"data": [str(store)], "seed": 2}))
    code, _, err = run("evaluate", "--config", file, "--out", tmp_path / "r")
    assert (code, "Traceback" in err) == (2, False)
    assert f"{store}: expected " in err


def test_a_file_gives_what_is_required_too(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('data = "s.zarr"\nout = "m"\n')
    for named in (["--config", str(file)], [f"--config={file}"]):
        assert read_given(["train", *named]) == {"config": file}


@pytest.mark.parametrize(
    ("command", "sentence"),
    [
        (("--modles", "all"), "Unknown option: --modles. Did you mean --models?"),
        (("--nothing-like-it", "1"), "nothing_like_it: expected an option, or a field of an"),
        (("--preset", "quickly"), "--preset: expected quick or fast or paper, found 'quickly'"),
        (("--markers", "some"), "--markers: expected a number, found 'some'"),
        (("--config", "none.toml"), "none.toml: expected options of 'afferents evaluate' by name"),
    ],
)
def test_what_is_no_option_is_refused(run, stores, tmp_path, command, sentence):
    code, _, err = run("evaluate", stores["video"], "--out", tmp_path / "r", *command)
    assert code == 2
    assert sentence in err
    assert not (tmp_path / "r").exists()

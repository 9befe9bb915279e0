"""What a newcomer reads first, against hand-built results."""

import re
import shlex

import pytest

from afferents.evaluation.train import can_be_felt
from afferents.models.model import MODELS
from afferents.reporting.html import render_report
from afferents.reporting.in_short import (
    ONLY_EVALUATED,
    beside_the_winner,
    headline,
    next_steps,
    sureness,
    what_was_asked,
)
from afferents.reporting.labels import and_seeds, interval_note


def texts(summary):
    return " ".join(f"{step.text} {step.command}" for step in next_steps(summary))


def test_it_says_what_was_held_out(summary):
    said = what_was_asked(summary)
    assert said.startswith("3 textures were slid over at 3 speeds, 10 to 40 mm/s.")
    assert "Each in turn was held out" in said


def test_of_another_split_it_names_the_groups(summary):
    summary |= {"split": "trial", "groups": ["1", "2"]}
    assert "3 textures were recorded with 2 values of trial: 1, 2." in what_was_asked(summary)


def test_it_says_what_else_came_out(summary):
    found = summary["models"]["vib-te-aug"]["nested"]
    found["recordings"] = {"mean_accuracy": 0.6, "ci95": [0.5, 0.7]}
    found["confusion"] = [[4, 0, 0], [1, 3, 0], [0, 0, 4]]
    summary["models"]["vib-te"]["nested"]["mean_accuracy"] = 0.55
    assert beside_the_winner(summary) == [
        "Of whole recordings, by all their samples together, it names 60.0 [50.0, 70.0] %.",
        "From the worst: 10 mm/s 25.0 %, 20 mm/s 50.0 %, 40 mm/s 75.0 %.",
        "vib-TE did better here, with 55.0 %. What we recommend is not picked by this test.",
        "Its most frequent mistake is to take 0.5 for 0: 25.0 % of the samples of 0.5.",
    ]


def test_no_mistake_no_sentence(summary):
    found = summary["models"]["vib-te-aug"]["nested"]
    found["confusion"] = [[4, 0, 0], [0, 3, 0], [0, 0, 4]]
    assert not any("mistake" in sentence for sentence in beside_the_winner(summary))


def test_next_steps_come_from_what_was_run(summary):
    said = texts(summary)
    assert "--preset fast" in said
    assert "on another day" in said
    assert "live" not in said  # tables can't be felt live
    assert "10 mm/s, the slowest speed" in said
    assert "afferents train fabricslide:elsewhere/cloth MODEL --model vib-te-aug" in said
    summary["preset"] = "fast"
    summary["data"][0]["simulated"] = True
    summary["models"]["vib-te-aug"]["nested"]["worst_speed"] = "20"
    said = texts(summary)
    assert "--preset" not in said
    assert "another day" not in said
    assert "docs/recording.md" in said
    assert "near 20 mm/s" in said


@pytest.mark.parametrize(
    ("intervals", "said", "unsaid"),
    [
        (None, "recordings of one texture are no independent trials", "session"),
        ({"replicate": "texture", "n": 13}, "They do not say how much another session", "few"),
        ({"replicate": "session", "n": 5}, "drawn over 5 sessions", "few"),
        ({"replicate": "session", "n": 2}, "2 are few", "textures"),
    ],
)
def test_it_says_what_intervals_leave_out(summary, intervals, said, unsaid):
    if intervals:
        summary["intervals"] = intervals
    text = sureness(summary)
    assert said in text
    assert unsaid not in text
    assert "--seeds 3" in text
    for protocols in summary["models"].values():
        for found in protocols.values():
            found["seeds"] = [0, 1, 2]
    assert "--seeds 3" not in sureness(summary)


def test_at_chance_nothing_was_learnt_and_nothing_follows(summary):
    for found in summary["models"].values():
        found["nested"] |= {"mean_accuracy": 0.522, "ci95": [0.0, 1.0]}
    assert headline(summary) == (
        "Nothing was learnt: vib-TE augmented names 52.2 [0.0, 100.0] % of the samples rightly at "
        "speeds that it never learnt from (nested protocol), and guessing gives 33.3 %."
    )
    assert next_steps(summary) == []


def test_models_that_cannot_be_kept_are_those_that_train_refuses():
    assert {name for name, one in MODELS.items() if not can_be_felt(one)} == ONLY_EVALUATED


def test_a_model_that_cannot_be_kept_is_named_with_the_best_that_can(summary):
    summary["data"][0]["kind"] = "store"
    summary["models"]["order-te"] = summary["models"].pop("vib-te-aug")
    summary["models"]["order-te"]["nested"]["mean_accuracy"] = 0.6
    last = next_steps(summary)[-1]
    assert "can't be trained to be kept; of those evaluated the best that can is" in last.text
    assert "--model vib-te\nafferents export MODEL model.onnx\nafferents live" in last.command
    assert last.command.endswith("--audio mic:default --web")
    del summary["models"]["vib-te"]
    assert "but not trained to be kept" in next_steps(summary)[-1].text


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("model", ["sa-wave-vector", "vib-te-aug"])
def test_each_step_is_a_command_that_the_shell_takes(summary, simulated, model, tmp_path, fails):
    """What it lacks here is the data, the model or the device, never an option or a source."""
    summary["data"][0] |= {"kind": "store", "simulated": simulated, "source": str(tmp_path / "s")}
    summary["models"][model] = summary["models"].pop("vib-te-aug")
    commands = [line for step in next_steps(summary) for line in step.command.splitlines()]
    assert [line.split()[1] for line in commands][-3:] == ["train", "export", "live"]
    for line in commands:
        said = fails(*shlex.split(line)[1:])
        assert re.search(r"(s|MODEL|model.onnx): expected", said), said


def test_the_page_begins_with_it(results):
    page = render_report(results, [])
    assert page.index("In short") < page.index("What was evaluated") < page.index("Table 1.")


def test_without_models_there_is_no_more_to_say(results):
    results.summary["models"] = {}
    assert next_steps(results.summary) == beside_the_winner(results.summary) == []
    assert "No model was evaluated." in render_report(results, [])


def test_of_markers_vibration_is_not_what_we_recommend(summary):
    summary["models"]["sa-se"] = summary["models"]["vib-te"]
    assert ", which did best, names" in headline(summary)
    first = next_steps(summary)[1]
    assert "SA-I vector waves: it was not run here" in first.text
    assert first.command.endswith("--models best --out BEST")
    del summary["models"]["sa-se"]
    assert ", which we recommend, names" in headline(summary)
    assert "not run here" not in texts(summary)


def test_intervals_name_seeds_only_where_there_are_several(summary):
    assert "seeds" not in interval_note(summary, and_seeds(summary))
    summary["models"]["vib-te"]["nested"]["seeds"] = [0, 1, 2]
    assert "and over training seeds" in interval_note(summary, and_seeds(summary))

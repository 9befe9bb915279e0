"""The page: what a newcomer reads first, well formed, self-contained, saying what must be said."""

import re
import shlex
from html.parser import HTMLParser

import pytest

from afferents.evaluation.results import Results
from afferents.evaluation.schemas import Lost, Summary
from afferents.reporting.figures import FigureData, draw_pictures
from afferents.reporting.page import facts, keep_units, redo_command, render_report
from afferents.reporting.summary_text import (
    beside_the_winner,
    headline,
    next_steps,
    sureness,
    what_was_asked,
    what_was_lost,
)

VOID = {"meta", "img", "br", "hr", "link", "input"}
S = Summary.model_validate


class Page(HTMLParser):
    """Collects attributes and text, and insists on tags that close in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.links, self.ids, self.strong = [], [], [], [], ""
        self.images = []
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.tags.append(tag)
        self.links += [values[name] for name in ("src", "href", "srcset") if name in values]
        self.ids += [values["id"]] if "id" in values else []
        self.images += [values] if tag == "img" else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag, f"</{tag}> closes the wrong element"

    def handle_data(self, data):
        if "strong" in self.open:
            self.strong += data


@pytest.fixture
def rendered(results, summary):
    """Return the page of the summary as it stands when asked."""

    def render(*pictures_and_notes):
        found = Results(results.root, results.config, S(summary), results.predictions)
        return render_report(found, *(pictures_and_notes or ([],)))

    return render


def test_the_page_is_well_formed_with_one_h1_and_needs_no_network(results, rendered):
    pictures = draw_pictures(results, FigureData())[:2]
    text = rendered(pictures, ["A note."])
    page = Page(text)
    assert page.tags.count("h1") == 1
    assert len(page.ids) == len(set(page.ids))
    assert not {"script", "link", "iframe"} & set(page.tags)
    assert page.links
    assert all(link.startswith(("data:", "#")) for link in page.links)
    assert not any(word in text.replace("http-equiv", "") for word in ("url(", "@import", "http"))
    assert "A note." in text
    assert len(page.images) == 2
    assert all(len(image["alt"]) > 20 for image in page.images)


def test_the_page_begins_with_what_came_out_and_holds_the_tables(rendered):
    text = rendered()
    assert text.index("Table 1.") < text.index("In short") < text.index("What was evaluated")
    for said in (
        "50.0 [40.2, 60.3]",
        "no reproduction",
        "2,468 of 2,468 test samples are of a speed that picked the model",
        "Confidence and accuracy",
        "TE: temporal encoding",
    ):
        assert said in text
    assert 'class="shaded" style="--p:25%">25.0' in text


def test_what_is_wrong_with_recordings_stands_in_bold(summary, rendered):
    assert not {"skipped", "Simulated"} & set(Page(rendered()).strong.split())
    summary["skipped"] = [{"recording": "3/50", "reason": "video ends at frame 12"}]
    summary["data"][0]["simulated"] = True
    strong = Page(rendered()).strong
    assert "1 recording was skipped" in strong
    assert "3/50" in strong
    assert "Simulated recordings." in strong
    assert "video ends at frame 12" in rendered()


def test_names_are_escaped(summary, results):
    summary["textures"][2] = "<b>Linen & co</b>"
    rows = results.predictions.replace("Linen", summary["textures"][2])
    text = render_report(Results(results.root, results.config, S(summary), rows), [])
    assert "<b>Linen" not in text
    assert "&lt;b&gt;Linen &amp; co" in text


def test_a_line_does_not_break_between_a_number_and_its_unit():
    assert keep_units("at 10 mm/s for 2 s, 20 of 30 samples") == (
        "at 10\u00a0mm/s for 2\u00a0s, 20 of 30 samples"
    )


def test_facts_name_what_was_chosen_and_only_that(summary):
    assert not {"Steady part", "Corrupted when tested"} & {name for name, _ in facts(S(summary))}
    summary |= {"disturb": {"markers": 0.1}, "recipe": {"spatial-net": {"max_epochs": 4}}}
    said = dict(facts(S(summary)))
    assert said["Corrupted when tested"] == "markers=0.1"
    assert said["Set otherwise: spatial-net"] == "max_epochs = 4"


def test_command_repeats_the_evaluation(results, summary):
    assert redo_command(results) == (
        "afferents evaluate fabricslide:elsewhere/cloth --out OUT --models vib-te,vib-te-aug "
        "--protocol both --cut all --preset quick --seed 0 --seeds 1"
    )


# In short.


def texts(summary):
    return " ".join(f"{step.text} {step.command}" for step in next_steps(S(summary)))


def test_headline_names_what_is_recommended_under_the_strictest_protocol(summary):
    summary["models"]["vib-te-aug"]["nested"]["mean_accuracy"] = 0.6
    summary["models"]["vib-te"]["published"]["mean_accuracy"] = 0.99
    said = headline(S(summary))
    assert said.startswith(
        "vib-TE augmented, which we recommend, recognises the texture in 60.0 [40.2, 60.3]% of the "
        "samples at speeds that it never learnt from (nested protocol; 95% interval in brackets)"
    )
    assert "guessing gives 33.3%" in said
    assert "worst at 10 mm/s, with 25.0%" in said
    del summary["models"]["vib-te-aug"]
    assert ", which did best, recognises" in headline(S(summary))


def test_without_models_there_is_no_more_to_say(summary, rendered):
    summary["models"] = {}
    assert headline(S(summary)) == "No model was evaluated."
    assert next_steps(S(summary)) == beside_the_winner(S(summary)) == []
    assert "No model was evaluated." in rendered()


def test_it_says_what_was_held_out(summary):
    said = what_was_asked(S(summary))
    assert said.startswith("3 textures were slid over at 3 speeds, 10 to 40 mm/s.")
    assert "Each in turn was held out" in said
    summary |= {"split": "trial", "groups": ["1", "2"], "speeds_mm_s": [], "models": {}}
    assert "3 textures were recorded with 2 values of trial: 1, 2." in what_was_asked(S(summary))


def test_it_says_what_was_lost():
    lost = Lost(median=0.01, worst=0.015, recording="0/10", n=3)
    assert "1.0% were lost (median of 3 recordings; at most 1.5%, in recording 0/10)" in (
        what_was_lost(lost)
    )
    assert what_was_lost(Lost(median=0, worst=0, recording="x", n=1)) == "No marker was lost."
    assert what_was_lost(None) == ""


def test_it_says_what_else_came_out(summary):
    found = summary["models"]["vib-te-aug"]["nested"]
    found["recordings"] |= {"mean_accuracy": 0.6, "ci95": [0.5, 0.7]}
    found["confusion"] = [[4, 0, 0], [1, 3, 0], [0, 0, 4]]
    summary["models"]["vib-te"]["nested"]["mean_accuracy"] = 0.55
    assert beside_the_winner(S(summary)) == [
        "It recognises the texture of 60.0 [50.0, 70.0]% of whole recordings, from all their "
        "samples together.",
        "From the worst: 10 mm/s 25.0%, 20 mm/s 50.0%, 40 mm/s 75.0%.",
        "vib-TE did better here, with 55.0%. What we recommend is not picked by this test.",
        "Its most frequent mistake is to take 0.5 for 0: 25.0% of the samples of 0.5.",
    ]
    found["confusion"] = [[4, 0, 0], [0, 3, 0], [0, 0, 4]]
    assert not any("mistake" in sentence for sentence in beside_the_winner(S(summary)))


@pytest.mark.parametrize(
    ("intervals", "said", "unsaid"),
    [
        ({"replicate": "texture", "n": 13}, "They do not say how much another session", "few"),
        ({"replicate": "session", "n": 5}, "drawn over 5 sessions", "few"),
        ({"replicate": "session", "n": 2}, "2 are few", "textures"),
    ],
)
def test_it_says_what_intervals_leave_out(summary, intervals, said, unsaid):
    summary["intervals"] = intervals
    text = sureness(S(summary))
    assert said in text
    assert unsaid not in text
    assert "over training seeds" not in text
    assert "--seeds 3" in text
    for protocols in summary["models"].values():
        for found in protocols.values():
            found["seeds"] = [0, 1, 2]
    assert "--seeds 3" not in sureness(S(summary))
    assert "and over training seeds" in sureness(S(summary))


def test_at_chance_nothing_was_learnt_and_nothing_follows(summary):
    for found in summary["models"].values():
        found["nested"] |= {"mean_accuracy": 0.522, "ci95": [0.0, 1.0]}
    assert headline(S(summary)) == (
        "Nothing was learnt: vib-TE augmented recognises the texture in 52.2 [0.0, 100.0]% of the "
        "samples at speeds that it never learnt from (nested protocol), and guessing gives 33.3%."
    )
    assert next_steps(S(summary)) == []


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


def test_of_markers_vibration_is_not_what_we_recommend(summary):
    summary["models"]["sa-se"] = summary["models"]["vib-te"]
    assert ", which did best, recognises" in headline(S(summary))
    first = next_steps(S(summary))[1]
    assert "SA-I vector waves: it was not run here" in first.text
    assert first.command.endswith("--models best --out BEST")
    del summary["models"]["sa-se"]
    assert "not run here" not in texts(summary)


def test_a_model_that_cannot_be_kept_is_named_with_the_best_that_can(summary):
    summary["data"][0]["kind"] = "store"
    summary["models"]["order-te"] = summary["models"].pop("vib-te-aug")
    summary["models"]["order-te"]["nested"]["mean_accuracy"] = 0.6
    last = next_steps(S(summary))[-1]
    assert "can't be trained to be kept; of those evaluated the best that can is" in last.text
    assert "--model vib-te\nafferents export MODEL model.onnx\nafferents live" in last.command
    assert last.command.endswith("--audio mic:default --web")
    del summary["models"]["vib-te"]
    assert "but not trained to be kept" in next_steps(S(summary))[-1].text


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("model", ["sa-wave-vector", "vib-te-aug"])
def test_each_step_is_a_command_that_the_shell_takes(summary, simulated, model, tmp_path, fails):
    """What it lacks here is the data, the model or the device, never an option or a source."""
    summary["data"][0] |= {"kind": "store", "simulated": simulated, "source": str(tmp_path / "s")}
    summary["models"][model] = summary["models"].pop("vib-te-aug")
    commands = [line for step in next_steps(S(summary)) for line in step.command.splitlines()]
    assert [line.split()[1] for line in commands][-3:] == ["train", "export", "live"]
    for line in commands:
        said = fails(*shlex.split(line)[1:])
        assert re.search(r"(s|MODEL|model.onnx): expected", said), said

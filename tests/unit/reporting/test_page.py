"""The page: what a newcomer reads first, well formed, self-contained, saying what must be said."""

import re
import shlex
from html.parser import HTMLParser

import pytest

from afferents.evaluation.results import Results, Summary
from afferents.reporting.data import FigureData
from afferents.reporting.labels import source_line
from afferents.reporting.page import render_report, write_command
from afferents.reporting.report import draw_pictures
from afferents.reporting.text import (
    describe_question,
    describe_uncertainty,
    headline,
    list_findings,
    list_next_steps,
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
    assert "50.0 [40.2, 60.3]" in text
    assert "2,468 of 2,468 test samples are of a speed that picked the model" in text
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


def test_a_control_and_what_was_asked_for_are_named_wherever_numbers_stand(summary, rendered):
    options = {"control": "permuted", "textures": ["a", "e"]}
    summary |= {"control": "permuted", "options": options, "n_used": 6}
    text, found = rendered(), S(summary)
    assert "it never learnt from, in a control: labels permuted (nested" in headline(found)
    assert list_next_steps(found) == []
    assert "Not of the recordings as they are, but a control: labels permuted. " in text
    assert "<dd>--control permuted --textures a,e</dd>" in text
    assert "(9 recordings), 6 of them used · control: labels permuted" in source_line(found)


def test_names_are_escaped(summary, results):
    summary["textures"][2] = "<b>Linen & co</b>"
    rows = results.predictions.replace("Linen", summary["textures"][2])
    text = render_report(Results(results.root, results.config, S(summary), rows), [])
    assert "<b>Linen" not in text
    assert "&lt;b&gt;Linen &amp; co" in text


def test_command_repeats_the_evaluation(results, summary):
    assert write_command(results) == (
        "afferents evaluate --config OUT/results/config.json --out AGAIN --protocol both --models "
        "vib-te,vib-te-aug"
    )
    for found in summary["models"].values():
        found["nested"]["seeds"] = [3, 4]
        del found["published"]
    several = Results(results.root, results.config, S(summary), results.predictions)
    assert "--out AGAIN --seed 3 --seeds 2 --models" in write_command(several)


# In short.


def test_headline_names_what_is_recommended_under_the_strictest_protocol(summary):
    """By what the data support: markers in no grid have been lost too, and give no waves."""
    summary["lost"] = {"median": 0.1, "worst": 0.1, "recording": "0/10", "n": 9}
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


def test_it_says_what_else_came_out(summary):
    assert "It did best of the 2 models evaluated." in list_findings(S(summary))
    found = summary["models"]["vib-te-aug"]["nested"]
    found["recordings"] |= {"mean_accuracy": 0.6, "ci95": [0.5, 0.7]}
    found["confusion"] = [[4, 0, 0], [1, 3, 0], [0, 0, 4]]
    summary["models"]["vib-te"]["nested"]["mean_accuracy"] = 0.55
    assert list_findings(S(summary)) == [
        "It recognises the texture of 60.0 [50.0, 70.0]% of whole recordings, from all their "
        "samples together.",
        "From the worst: 10 mm/s 25.0%, 20 mm/s 50.0%, 40 mm/s 75.0%.",
        "vib-TE did better here, with 55.0%. What we recommend was picked once, "
        "on the simulated rig, and not by this test.",
        "Its most frequent mistake is to take 0.5 for 0: 25.0% of the samples of 0.5.",
    ]
    found["confusion"] = [[4, 0, 0], [0, 3, 0], [0, 0, 4]]
    assert not any("mistake" in sentence for sentence in list_findings(S(summary)))


def test_models_are_compared_within_a_modality_first(summary, rendered):
    summary["models"]["sa-se"] = summary["models"]["ra-se"] = summary["models"]["vib-te"]
    pairs = [("ra-se", "sa-se"), ("vib-te", "sa-se"), ("vib-te-aug", "vib-te")]
    summary["comparisons"] = [
        {"protocol": "nested", "model": one, "than": than, "difference": 0.05, "ci95": [-0.02, 0.1]}
        for one, than in pairs
    ]
    first, second, *_ = list_findings(S(summary))
    assert first == (
        "Within a modality, in percentage points: RA-SE over SA-SE +5.0 [-2.0, +10.0] (paper +7); "
        "vib-TE augmented over vib-TE +5.0 [-2.0, +10.0] (paper +40)."
    )
    assert "cautions against comparisons across modalities" in second
    text = rendered()
    assert text.index(">Differences<") < text.index("Samples and whole recordings")


def test_what_was_asked_says_what_was_learnt_from_and_tested(summary):
    asked = describe_question(S(summary))
    assert "from the recordings of the others, and then" in asked
    assert "in every sample of this one. So" in asked
    summary["options"] = {"test_only": {"repetition": "1"}}
    asked = describe_question(S(summary))
    assert "of the others that are not of repetition=1, and" in asked
    assert "in every sample of this one that is of repetition=1." in asked
    for found in summary["models"].values():
        del found["nested"]
    asked = describe_question(S(summary))
    assert "in half of the samples of this one that is of repetition=1. The other half" in asked
    summary["options"] = {"train_speeds": 2}
    assert "from the recordings of 2 of the others, and then" in describe_question(S(summary))
    for found in summary["models"].values():
        found["published"]["leaks"]["test_samples_of_a_speed_seen_in_validation"] = 0
    assert "The other half" not in describe_question(S(summary)), "of what is solved at once"


def test_arcs_are_parts_of_the_same_recordings(summary):
    summary |= {"split": "angle-3", "groups": ["1", "2", "3"], "speeds_mm_s": [], "models": {}}
    assert describe_question(S(summary)).startswith(
        "The drum of each of 3 textures was divided into 3 arcs of the drum. Each in turn was "
        "held out: a model learnt from the parts of recordings in the others, and then had"
    )


@pytest.mark.parametrize(
    ("intervals", "said", "unsaid"),
    [
        ({"replicate": "texture", "n": 13}, "in this one session. They do not say how", "few"),
        ({"replicate": "session", "n": 5}, "drawn over 5 sessions", "few"),
        ({"replicate": "session", "n": 2}, "2 are few", "textures"),
    ],
)
def test_it_says_what_intervals_leave_out(summary, intervals, said, unsaid):
    summary["intervals"] = intervals
    text = describe_uncertainty(S(summary))
    assert said in text
    assert unsaid not in text
    assert "--seeds 3" in text
    for protocols in summary["models"].values():
        for found in protocols.values():
            found["seeds"] = [0, 1, 2]
    assert "and over training seeds" in describe_uncertainty(S(summary))
    summary |= {"intervals": {"replicate": "texture", "n": 13}, "data": 2 * summary["data"]}
    assert "may differ in these sessions. They" in describe_uncertainty(S(summary))


def test_at_chance_nothing_was_learnt_and_nothing_follows_as_without_models(summary, rendered):
    for found in summary["models"].values():
        found["nested"] |= {"mean_accuracy": 0.322, "ci95": [0.0, 1.0]}
    assert headline(S(summary)) == (
        "Nothing was learnt: vib-TE augmented recognises the texture in 32.2 [0.0, 100.0]% of the "
        "samples at speeds that it never learnt from (nested protocol), and guessing gives 33.3%."
    )
    assert list_next_steps(S(summary)) == []
    summary["models"] = {}
    assert headline(S(summary)) == "No model was evaluated."
    assert list_next_steps(S(summary)) == list_findings(S(summary)) == []
    assert "No model was evaluated." in rendered()


def test_a_wide_interval_does_not_say_that_nothing_was_learnt(summary):
    summary["intervals"] = {"replicate": "session", "n": 2}
    summary["models"]["vib-te-aug"]["nested"] |= {"mean_accuracy": 0.76, "ci95": [0.0, 1.0]}
    assert "33.3%. 2 sessions are too few to tell that from guessing. It" in headline(S(summary))
    assert list_next_steps(S(summary))


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("model", ["sa-wave-vector", "vib-te-aug"])
def test_each_step_is_a_command_that_the_shell_takes(summary, simulated, model, tmp_path, fails):
    """What it lacks here is the data, the model or the device, never an option or a source."""
    options = {"markers": 0.5, "window_s": 0.5, "split": "trial"}
    summary |= {"cut": "published", "preset": "paper", "options": options}
    summary["data"][0] |= {"kind": "store", "simulated": simulated, "source": str(tmp_path / "s")}
    summary["models"][model] = summary["models"].pop("vib-te-aug")
    steps = list_next_steps(S(summary), tmp_path / "r")
    commands = [line for step in steps for line in step.command.splitlines()]
    assert [line.split()[1] for line in commands][-3:] == ["train", "export", "live"]
    both = "--split trial --cut published --preset paper"
    assert all(both in line for line in commands if line.split()[1] in ("evaluate", "train"))
    assert not any("--markers" in line for line in commands)
    assert f"--results {tmp_path / 'r'}" in commands[-3]
    for line in commands:
        said = fails(*shlex.split(line)[1:])
        assert re.search(r"(s|MODEL|model.onnx): expected", said), said

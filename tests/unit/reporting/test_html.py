"""The page: well formed, self-contained, and saying what must be said."""

from html.parser import HTMLParser
from pathlib import Path

import pytest

from afferents.reporting.html import redo_command, render_report, write_report
from afferents.reporting.in_short import headline
from afferents.reporting.pictures import FigureData, draw_pictures

VOID = {"meta", "img", "br", "hr", "link", "input"}


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
def pictures(results):
    return draw_pictures(results, FigureData())[:2]


def test_page_is_well_formed_with_one_h1_and_unique_ids(results, pictures):
    page = Page(render_report(results, pictures, ["A note."]))
    assert page.tags.count("h1") == 1
    assert len(page.ids) == len(set(page.ids))
    assert [tag for tag in page.tags if tag in ("script", "link", "iframe")] == []


def test_page_needs_no_network(results, pictures):
    text = render_report(results, pictures)
    assert Page(text).links
    assert all(link.startswith(("data:", "#")) for link in Page(text).links)
    assert "url(" not in text
    assert "@import" not in text
    assert "http" not in text.replace("http-equiv", "")


def test_images_say_what_they_show(results, pictures):
    images = Page(render_report(results, pictures)).images
    assert len(images) == 2
    assert all(len(image["alt"]) > 20 for image in images)


def test_interval_and_published_mean_are_on_the_page(results):
    text = render_report(results, [])
    assert "50.0 [40.2, 60.3]" in text
    assert "no reproduction" in text
    assert "2,468 of 2,468 test samples are of a speed that picked the model" in text


def test_skipped_recordings_stand_in_bold(results):
    assert "skipped" not in Page(render_report(results, [])).strong
    results.summary["skipped"] = [{"recording": "3/50", "reason": "video ends at frame 12"}]
    page = Page(render_report(results, []))
    assert "1 recording was skipped" in page.strong
    assert "3/50" in page.strong
    assert "video ends at frame 12" in render_report(results, [])


def test_simulated_recordings_are_called_so(results):
    assert "Simulated" not in render_report(results, [])
    results.summary["data"][0]["simulated"] = True
    assert "Simulated recordings." in Page(render_report(results, [])).strong


def test_names_are_escaped(results):
    results.summary["textures"][2] = "<b>Linen & co</b>"
    text = render_report(results, [])
    assert "<b>Linen" not in text
    assert "&lt;b&gt;Linen &amp; co" in text


def test_headline_names_the_best_under_the_strictest_protocol(summary):
    summary["models"]["vib-te-aug"]["nested"]["mean_accuracy"] = 0.6
    summary["models"]["vib-te"]["published"]["mean_accuracy"] = 0.99
    assert headline(summary).startswith(
        "vib-TE augmented, which we recommend, names 60.0 [40.2, 60.3] % of the samples rightly at "
        "speeds that it never learnt from (nested protocol; 95% interval in brackets)"
    )
    assert "guessing gives 33.3 %" in headline(summary)
    assert "worst at 10 mm/s, with 25.0 %" in headline(summary)


def test_headline_without_what_is_recommended_names_the_best(summary):
    del summary["models"]["vib-te-aug"]
    assert "which did best, names" in headline(summary)


def test_headline_without_models(summary):
    summary["models"] = {}
    assert headline(summary) == "No model was evaluated."


def test_command_repeats_the_evaluation(results):
    assert redo_command(results) == (
        "afferents evaluate fabricslide:elsewhere/cloth --out OUT --models vib-te,vib-te-aug "
        "--protocol both --cut all --preset quick --seed 0 --seeds 1"
    )


def test_report_is_written_whole_and_nothing_beside_it(results, tmp_path):
    path = write_report(tmp_path / "report.html", results, [], ["Figure 7 is left out."])
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert "Figure 7 is left out." in path.read_text(encoding="utf-8")
    assert [entry.name for entry in Path(tmp_path).iterdir()] == ["report.html"]

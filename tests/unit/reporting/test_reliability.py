"""The reliability diagram and its table, from a summary."""

import numpy as np
import pytest

from afferents.reporting.accuracy_figures import reliability_figure, reliability_table
from afferents.reporting.html import render_report
from afferents.reporting.pictures import FigureData, draw_pictures

BINS = {"ece": 0.1, "count": [0, 30, 10], "confidence": [0, 0.5, 0.9], "accuracy": [0, 0.4, 1.0]}


@pytest.fixture
def told(results):
    """Results of which one model says how reliable it is, and the other is of an old folder."""
    results.summary["models"]["vib-te"]["nested"]["reliability"] = BINS
    return results


def test_the_table_says_it_in_percent(told):
    table = reliability_table(told.summary)
    rows = {(row[0].text, row[1].text): [cell.text for cell in row[2:]] for row in table.rows}
    assert rows["vib-TE", "nested protocol"] == ["60.0", "55.0", "10.0"]
    assert rows["vib-TE augmented", "published protocol"] == ["—"] * 3
    assert "3 bins" in table.caption


def test_marks_lie_where_the_bins_are(told):
    panel = reliability_figure(told.summary).axes[2]
    assert panel.get_title(loc="left") == "vib-TE"
    marks = panel.collections[0]
    np.testing.assert_allclose(marks.get_offsets(), [[50, 40], [90, 100]])
    assert marks.get_sizes()[0] == pytest.approx(3 * marks.get_sizes()[1])
    assert [text.get_text() for text in panel.texts] == ["ECE 10.0 %"]


def test_who_says_nothing_of_it_is_still_reported(results, told):
    names = [picture.name for picture in draw_pictures(told, FigureData())]
    assert names.count("reliability") == 1
    assert "Confidence and accuracy" in render_report(told, [])
    del told.summary["models"]["vib-te"]["nested"]["reliability"]
    assert "reliability" not in [p.name for p in draw_pictures(told, FigureData())]
    assert "Confidence and accuracy" not in render_report(told, [])

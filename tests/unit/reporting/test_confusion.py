"""Confusion matrices: counted right, in percent of the true texture, drawn on one scale."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from afferents.evaluation.results import Summary
from afferents.reporting.grids import confusion_figure
from afferents.reporting.published import published_textures
from afferents.reporting.style import normalise


def matrices(figure):
    """Return the drawn matrices by title, percent[predicted, true] as on the screen."""
    return {
        axes.get_title(): np.ma.filled(axes.images[0].get_array(), np.nan)
        for axes in figure.axes
        if axes.images
    }


@given(hnp.arrays(np.int64, (4, 4), elements=st.integers(0, 1000)))
def test_every_tested_texture_sums_to_100(counts):
    sums = normalise(counts).sum(axis=1)
    tested = counts.sum(axis=1) > 0
    np.testing.assert_allclose(sums[tested], 100)
    assert np.isnan(sums[~tested]).all()


def test_each_speed_and_all_have_a_panel_with_true_on_x_predicted_on_y(results):
    assert confusion_figure(results, "sa-se", "nested") is None  # which was not evaluated
    figure = confusion_figure(results, "vib-te", "nested")
    drawn = matrices(figure)
    assert list(drawn) == [
        "10 mm/s held out: 25%",
        "20 mm/s held out: 50%",
        "40 mm/s held out: 75%",
        "all held-out speeds: 50%",
    ]
    first = drawn["10 mm/s held out: 25%"]
    np.testing.assert_allclose(first.sum(axis=0), 100)
    assert first[0, 1] == pytest.approx(75)  # three of four of texture 1 were taken for 0
    assert first[1, 0] == 0
    assert figure.axes[0].images[0].get_clim() == (0, 100)
    assert figure.get_suptitle() == "Figure 13A. vib-TE, nested protocol"


def test_papers_matrix_stands_beside_ours_where_the_textures_are_its_own(results, summary):
    summary["textures"] = list(published_textures())
    rows = results.predictions.replace("Linen", "6")
    same = replace(results, predictions=rows, found=Summary.model_validate(summary))
    drawn = matrices(confusion_figure(same, "vib-te", "nested"))
    paper = drawn["paper, its own recordings: 50%"]
    np.testing.assert_allclose(paper.sum(axis=0), 100, atol=0.2)


def test_figure_13_is_drawn_as_printed_and_as_it_should_be(results):
    figure = confusion_figure(results, "vib-te", "nested", "paper")
    images = [axes.images[0].get_array() for axes in figure.findobj(lambda a: hasattr(a, "images"))
              if axes.images and axes.images[0].get_array().shape == (3, 3)]  # fmt: skip
    assert len(images) == 2 * 3  # speeds
    printed, proper = images[1], images[4]
    np.testing.assert_allclose(np.diag(proper), 50)
    np.testing.assert_allclose(np.diag(printed), 100)
    np.testing.assert_allclose(images[2].max(), 100)  # 75 % would print as 150

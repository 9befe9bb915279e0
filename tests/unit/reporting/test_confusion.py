"""Confusion matrices: counted right, in percent of the true texture, drawn on one scale."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from matplotlib.figure import Figure

from afferents.evaluation.schemas import Summary
from afferents.reporting.confusion import (
    Panel,
    confusion_figure,
    count_confusion,
    percent_of_true,
    write_numbers,
)
from afferents.reporting.figures import FigureData, draw_pictures
from afferents.reporting.published import published_textures


def matrices(figure):
    """Return the drawn matrices by title, percent[predicted, true] as on the screen."""
    return {
        axes.get_title(): np.ma.filled(axes.images[0].get_array(), np.nan)
        for axes in figure.axes
        if axes.images
    }


def test_counts_are_true_by_predicted():
    predictions = pd.DataFrame({"true_texture": ["a", "a", "b"], "predicted_texture": list("abb")})
    counts = count_confusion(predictions, ["a", "b", "c"])
    np.testing.assert_array_equal(counts, [[1, 1, 0], [0, 1, 0], [0, 0, 0]])


def test_60_of_60_are_100_percent_and_29_are_not():
    percent = percent_of_true(np.array([[60, 0], [31, 29]]))
    assert percent[0, 0] == 100
    assert percent[1, 1] == pytest.approx(48.333, abs=1e-3)


def test_texture_without_test_samples_is_missing_not_zero():
    assert np.isnan(percent_of_true(np.array([[0, 0], [1, 3]]))[0]).all()


@given(hnp.arrays(np.int64, (4, 4), elements=st.integers(0, 1000)))
def test_every_tested_texture_sums_to_100(counts):
    sums = percent_of_true(counts).sum(axis=1)
    tested = counts.sum(axis=1) > 0
    np.testing.assert_allclose(sums[tested], 100)
    assert np.isnan(sums[~tested]).all()


def test_figure_has_a_panel_a_speed_with_its_accuracy_and_one_for_all(results):
    drawn = matrices(confusion_figure(results, "vib-te", "nested"))
    assert list(drawn) == [
        "10 mm/s held out: 25%",
        "20 mm/s held out: 50%",
        "40 mm/s held out: 75%",
        "all held-out speeds: 50%",
    ]


def test_figure_has_true_on_x_predicted_on_y_and_columns_of_100(results):
    drawn = matrices(confusion_figure(results, "vib-te", "nested"))["10 mm/s held out: 25%"]
    np.testing.assert_allclose(drawn.sum(axis=0), 100)
    assert drawn[0, 1] == pytest.approx(75)  # three of four of texture 1 were taken for 0
    assert drawn[1, 0] == 0


def test_scale_is_0_to_100_and_names_the_protocol_and_the_data(results):
    figure = confusion_figure(results, "vib-te", "published")
    assert figure.axes[0].images[0].get_clim() == (0, 100)
    assert figure.get_suptitle() == "Figure 13A. vib-TE, published protocol"
    assert any("cloth (9 recordings)" in text.get_text() for text in figure.texts)


def numbers(axes):
    return {text.get_position(): text.get_text() for text in axes.texts}


def test_cells_carry_their_number_where_it_can_be_read(results):
    axes = confusion_figure(results, "vib-te", "nested").axes[0]
    assert numbers(axes) == {
        (0, 0): "25", (0, 2): "75", (1, 1): "25", (1, 0): "75", (2, 2): "25", (2, 1): "75",
    }  # fmt: skip
    assert {text.get_fontsize() for text in axes.texts} == {8.0}
    few = Panel("", np.array([[96.0, 4.0], [5.0, 95.0]]))
    write_numbers(axes := Figure().add_subplot(), few, 2.0)
    assert sorted(numbers(axes).values()) == ["5", "95", "96"]


@pytest.mark.parametrize(("n", "size"), [(13, 6.1), (20, None)])
def test_small_cells_carry_none(n, size):
    axes = Figure().add_subplot()
    write_numbers(axes, Panel("", 100 * np.eye(n)), 7.7 / 3)
    assert [round(text.get_fontsize(), 1) for text in axes.texts] == ([size] * n if size else [])


def test_not_evaluated_is_no_figure(results):
    assert confusion_figure(results, "sa-se", "nested") is None


def test_papers_matrix_stands_beside_ours_where_the_textures_are_its_own(results, summary):
    summary["textures"] = list(published_textures())
    rows = results.predictions.replace("Linen", "6")
    same = replace(results, predictions=rows, found=Summary.model_validate(summary))
    drawn = matrices(confusion_figure(same, "vib-te", "nested"))
    paper = drawn["paper, its own recordings: 50%"]
    np.testing.assert_allclose(paper.sum(axis=0), 100, atol=0.2)


@pytest.mark.parametrize("n", [1, 2])
def test_few_groups_can_be_drawn(results, n):
    rows = results.predictions
    few = replace(results, predictions=rows[rows["held_out_speed_mm_s"] < 15 * n])
    assert len(matrices(confusion_figure(few, "vib-te", "nested"))) == n + 1


def test_a_hundred_textures_can_be_drawn_with_few_labels(results, summary):
    summary["textures"] += [f"t{i}" for i in range(97)]
    many = replace(results, found=Summary.model_validate(summary))
    figure = confusion_figure(many, "vib-te", "nested")
    assert len(figure.axes[0].get_yticks()) <= 14


def test_figure_13_is_drawn_as_printed_and_as_it_should_be(results):
    figure = confusion_figure(results, "vib-te", "nested", "paper")
    images = [axes.images[0].get_array() for axes in figure.findobj(lambda a: hasattr(a, "images"))
              if axes.images and axes.images[0].get_array().shape == (3, 3)]  # fmt: skip
    assert len(images) == 2 * 3  # speeds
    printed, proper = images[1], images[4]
    np.testing.assert_allclose(np.diag(proper), 50)
    np.testing.assert_allclose(np.diag(printed), 100)
    np.testing.assert_allclose(images[2].max(), 100)  # 75 % would print as 150


def test_matrices_have_the_first_texture_at_the_top_left(results):
    figure = confusion_figure(results, "vib-te", "nested", "paper")
    panels = [axes for axes in figure.findobj(lambda a: hasattr(a, "images"))
              if axes.images and axes.images[0].get_array().shape == (3, 3)]  # fmt: skip
    for axes in panels:
        (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        assert left < right
        assert top < bottom
    names = [label.get_text() for label in panels[0].get_yticklabels()]
    assert names == results.textures
    pictures = draw_pictures(results, FigureData(), "paper")
    assert "the first at the top left" in pictures[-1].caption

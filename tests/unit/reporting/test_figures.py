"""Figures of the data: what is chosen, and that lines and images show the right numbers."""

from dataclasses import replace

import numpy as np
import pytest

from afferents.evaluation.results import Summary
from afferents.reporting.data import FigureData
from afferents.reporting.grids import (
    choose_stretch,
    images_figure,
    picture_accuracies,
    spectra_figure,
    stretch_figure,
)
from afferents.reporting.published import published_textures
from afferents.reporting.report import draw_pictures

S = Summary.model_validate


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def peak(points):
    return points[points[:, 1].argmax(), 0]


def test_the_example_is_the_papers_else_a_bumpy_drum_before_a_word_before_a_smooth_one(spectra):
    assert choose_stretch(spectra) == ("4", 40.0)
    assert choose_stretch(spectra[spectra["speed_mm_s"].values != 80.0]) is None
    names = spectra["texture"].values
    for others, chosen in ((("0", "3"), "3"), (("0", "Linen"), "Linen"), (("0", "0"), "0")):
        renamed = np.where(names == "3", others[0], others[1])
        assert choose_stretch(spectra.assign_coords(texture=("sample", renamed)))[0] == chosen


def test_figure07_puts_stretched_and_real_lines_at_the_same_true_frequency(spectra):
    figure = stretch_figure(spectra, "4", 40.0, "somewhere")
    assert figure.get_suptitle().endswith("texture i")
    upper, middle, lower = figure.axes
    assert peak(lines(upper)["recorded at 20 mm/s (2 windows)"]) == 40
    assert peak(lines(upper)["40 mm/s stretched by 0.5"]) == 40
    assert peak(lines(middle)["recorded at 40 mm/s (2 windows)"]) == 80
    assert peak(lines(lower)["recorded at 80 mm/s (2 windows)"]) == 160
    assert peak(lines(lower)["40 mm/s stretched by 2"]) == 160
    assert upper.get_xlim()[1] == min(200, spectra["frequency"].max())


def test_figure12_draws_true_frequencies_and_speeds_and_says_what_is_missing(spectra):
    gap = (spectra["texture"].values == "3") & (spectra["speed_mm_s"].values == 80.0)
    figure = spectra_figure(spectra[~gap], "somewhere")
    assert [axes.get_title() for axes in figure.axes[:3]] == ["20 mm/s", "40 mm/s", "80 mm/s"]
    assert peak(figure.axes[0].lines[0].get_xydata()) == 40
    assert [text.get_text() for text in figure.axes[2].texts] == ["not recorded"]


def test_each_recording_has_its_frames_in_a_row_and_a_scale_of_its_own_or_all_have_one(frames):
    figure = images_figure(frames, "sa1", "Images", "somewhere", "+x")
    first, second = ([axes.images[0] for axes in row] for row in rows_of(figure))
    assert [axes.get_title() for axes in figure.axes[:10]] == [f"+{10 * i} ms" for i in range(10)]
    assert figure.axes[0].get_ylabel() == "g\n50 mm/s"
    np.testing.assert_array_equal(first[1].get_array(), frames[0].images[1])
    assert len(second) == 4  # a short recording
    assert first[0].get_clim() == first[9].get_clim() != second[0].get_clim()
    assert len({image.get_clim() for image in shared(frames)}) == 1


def rows_of(figure):
    drawn = [axes for axes in figure.axes if axes.images and axes.images[0].get_array().ndim == 2]
    grid = [axes for axes in drawn if axes.images[0].get_array().shape == (4, 5)]
    return grid[:10], grid[10:]


def shared(frames):
    figure = images_figure(frames, "sa1", "Images", "somewhere", one_scale=True)
    return [axes.images[0] for row in rows_of(figure) for axes in row]


def panel_of(figure, title):
    return next(axes for axes in figure.axes if axes.get_title(loc="left") == title)


def test_speed_figure_draws_percent_and_the_interval_of_each_speed(results):
    panel = panel_of(next(picture_accuracies(results)).figure, "vib-TE")
    np.testing.assert_allclose(lines(panel)["nested protocol"], [[10, 25], [20, 50], [40, 75]])
    assert "paper, its own recordings" not in lines(panel)  # whose textures are others
    bars, shifted = panel.collections
    assert bars.get_segments()[0].tolist() == pytest.approx(np.array([[10, 15], [10, 35]]))
    assert shifted.get_segments()[0][0, 0] > 10  # both protocols' would hide each other
    caption = draw_pictures(results, FigureData())[0].caption
    assert "95% intervals, drawn over 3 textures, each with all its speeds" in caption
    assert "Open: published protocol" in caption


def test_the_papers_speeds_are_crosses_where_the_textures_are_its_own(results, summary):
    summary["textures"] = list(published_textures())
    ours = results.predictions.replace("Linen", "6")
    first = draw_pictures(replace(results, predictions=ours, found=S(summary)), FigureData())[0]
    crosses = lines(panel_of(first.figure, "vib-TE"))["paper, its own recordings"]
    np.testing.assert_allclose(crosses[0], [10, 16.8])
    assert "Crosses" in first.caption


def test_without_probabilities_reliability_is_not_drawn(results, summary):
    drawn = [one.name for one in draw_pictures(results, FigureData())]
    assert drawn[:3] == ["accuracy-by-speed", "accuracy-by-texture", "reliability"]
    for protocols in summary["models"].values():
        for found in protocols.values():
            found["reliability"] = None
    unsure = draw_pictures(replace(results, found=S(summary)), FigureData())
    assert "reliability" not in [one.name for one in unsure]

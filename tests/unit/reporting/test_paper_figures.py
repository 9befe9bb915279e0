"""Figures drawn as in the paper: what stands in for what, and what is drawn."""

import numpy as np
import pytest

from afferents.reporting.choice import PANELS, instead_of, shown_for
from afferents.reporting.confusion import matrices_figure
from afferents.reporting.drawings import DrawnLayer, DrawnNetwork, DrumView, networks_figure, shaded
from afferents.reporting.images import FrameRow, frames_figure
from afferents.reporting.paper import PaperData, draw_paper_pictures
from afferents.reporting.pictures import FigureData
from afferents.reporting.spectra import spectra_figure

NAMED = {"named_by_spacing": True}


def rows_of(recorded, n_frames=10):
    return [
        FrameRow(panel, shown, np.full((n_frames, 3, 3), i, np.float32), np.arange(n_frames) / 90)
        for i, panel in enumerate(PANELS)
        for shown in shown_for(PANELS[panel], recorded, NAMED)
    ]


def test_the_papers_own_are_shown_where_they_are_there():
    recorded = [(texture, float(v)) for texture in ("0", "3", "6") for v in range(10, 101, 10)]
    shown = [one for panel in PANELS.values() for one in shown_for(panel, recorded, NAMED)]
    assert [(one.texture, one.speed_mm_s) for one in shown] == [
        ("0", 50), ("3", 50), ("6", 50), ("3", 10), ("3", 50), ("3", 100),
    ]  # fmt: skip
    assert instead_of(shown) == ""


def test_the_nearest_speed_stands_in_and_is_named():
    (shown,) = shown_for([("g", 50.0)], [("3", 10.0), ("3", 40.0), ("0", 50.0)], NAMED)
    assert (shown.texture, shown.speed_mm_s) == ("3", 40.0)
    assert shown.label == "g\n40 mm/s\n(for 50)"
    assert instead_of([shown]).endswith("session lacks: g at 40 mm/s for 50 mm/s. ")


def test_other_textures_stand_in_by_their_place():
    recorded = [(name, 20.0) for name in ("cotton", "denim", "silk", "wool", "zinc")]
    shown = shown_for([("a", 50.0), ("g", 50.0), ("m", 50.0)], recorded, NAMED)
    assert [one.texture for one in shown] == ["cotton", "silk", "zinc"]
    assert shown[0].wanted == "a, 50"


def test_frames_have_one_scale():
    recorded = [("0", 50.0), ("3", 10.0), ("3", 50.0), ("3", 100.0), ("6", 50.0)]
    figure = frames_figure(rows_of(recorded), "Figure 8", "SA-I (px)", "data", "-y")
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert len(images) == 6 * 10
    assert {image.get_clim() for image in images} == {(0.0, 1.0)}
    assert "one scale for all" in figure.axes[-1].get_ylabel()


def test_a_short_recording_has_fewer_frames():
    figure = frames_figure(rows_of([("0", 50.0)], n_frames=3), "Figure 8", "SA-I (px)", "data")
    assert len([axes for axes in figure.axes if axes.images]) == 6 * 3


def test_spectra_of_one_window_and_the_mean(spectra):
    one = spectra_figure(spectra, "data")
    assert len(one.axes) == 15
    panel = one.axes[1]
    assert panel.get_title() == "40 mm/s (for a)"
    assert [line.get_label() for line in panel.lines] == ["one window", "mean over windows"]
    assert panel.lines[0].get_ydata().argmax() == 80
    assert len({axes.get_ylim() for axes in one.axes}) == 1
    assert "each texture its own scale" in spectra_figure(spectra, "data", False)._supylabel._text


def test_figure_13_is_drawn_as_printed_and_as_it_should_be(results):
    figure = matrices_figure(results, "vib-te", "nested")
    images = [axes.images[0].get_array() for axes in figure.findobj(lambda a: hasattr(a, "images"))
              if axes.images and axes.images[0].get_array().shape == (3, 3)]  # fmt: skip
    assert len(images) == 2 * 3  # speeds
    printed, proper = images[1], images[4]
    np.testing.assert_allclose(np.diag(proper), 50)
    np.testing.assert_allclose(np.diag(printed), 100)
    np.testing.assert_allclose(images[2].max(), 100)  # 75 % would print as 150


def test_matrices_have_the_first_texture_at_the_top_left(results):
    figure = matrices_figure(results, "vib-te", "nested")
    panels = [axes for axes in figure.findobj(lambda a: hasattr(a, "images"))
              if axes.images and axes.images[0].get_array().shape == (3, 3)]  # fmt: skip
    for axes in panels:
        (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        assert left < right
        assert top < bottom
    names = [label.get_text() for label in panels[0].get_yticklabels()]
    assert names == results.textures
    pictures = draw_paper_pictures(results, FigureData(), PaperData())
    assert "the first at the top left" in pictures[-1].caption


def test_what_the_paper_has_no_matrices_of_keeps_its_own(results):
    results.summary["models"]["order-te"] = results.summary["models"].pop("vib-te-aug")
    results.predictions["model"] = results.predictions["model"].replace("vib-te-aug", "order-te")
    assert matrices_figure(results, "order-te", "nested") is None
    names = [one.name for one in draw_paper_pictures(results, FigureData(), PaperData())]
    assert names[2:] == [
        "paper-confusion-vib-te-nested", "paper-confusion-vib-te-published",
        "confusion-order-te-nested", "confusion-order-te-published",
    ]  # fmt: skip


def test_a_network_is_drawn_layer_by_layer():
    layers = (DrawnLayer("Conv 64", "9 x 9 x 64", 5184, 640), DrawnLayer("Dense 13", "13", 13, 221))
    network = DrawnNetwork("SA-SE", "9 x 9", layers, 861, 861)
    figure = networks_figure([network], "Figure 5", "data")
    (axes,) = figure.axes
    texts = [text.get_text() for text in axes.texts]
    assert {"9 x 9 x 64", "640", "Dense 13", "861 parameters, of which 861 are trainable"} <= {
        *texts
    }
    widths = [patch.get_width() for patch in axes.patches]
    assert widths[0] > widths[1]


def test_a_bump_catches_the_light_on_its_upper_side():
    """Light comes from above: of a bump in the middle the upper slope is lighter than the lower."""
    height = np.zeros((800, 100), np.float32)
    along = np.arange(800)
    ridge = np.minimum(along, 800 - along)  # 0 in the middle of the picture
    height[ridge < 8] = (8 - ridge[ridge < 8, None]) * 0.05
    flat = shaded(DrumView("a", np.zeros_like(height), 251.0, 36.0))
    light = shaded(DrumView("b", height, 251.0, 36.0))
    middle = len(light) // 2
    assert light.shape == flat.shape == (int(251 / np.pi / 0.24), 150)
    assert light[middle - 6, 75] > flat[middle - 6, 75]
    assert light[middle + 6, 75] < flat[middle + 6, 75]
    assert light[10, 75] == pytest.approx(flat[10, 75])

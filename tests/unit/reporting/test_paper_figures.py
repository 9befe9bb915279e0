"""Figures drawn as in the paper: what stands in for what, and what is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from afferents.evaluation.schemas import Summary
from afferents.reporting.choice import PANELS, instead_of, shown_for
from afferents.reporting.confusion import confusion_figure
from afferents.reporting.drawings import DrawnLayer, DrawnNetwork, DrumView, networks_figure, shaded
from afferents.reporting.figures import FigureData, draw_pictures
from afferents.reporting.images import FrameRow, printed_images_figure
from afferents.reporting.spectra import spectra_figure


def rows_of(recorded, n_frames=10):
    return [
        FrameRow(panel, shown, np.full((n_frames, 3, 3), i, np.float32), np.arange(n_frames) / 90)
        for i, panel in enumerate(PANELS)
        for shown in shown_for(PANELS[panel], recorded, True)
    ]


def test_the_papers_own_are_shown_where_they_are_there():
    recorded = [(texture, float(v)) for texture in ("0", "3", "6") for v in range(10, 101, 10)]
    shown = [one for panel in PANELS.values() for one in shown_for(panel, recorded, True)]
    assert [(one.texture, one.speed_mm_s) for one in shown] == [
        ("0", 50), ("3", 50), ("6", 50), ("3", 10), ("3", 50), ("3", 100),
    ]  # fmt: skip
    assert instead_of(shown) == ""


def test_the_nearest_speed_stands_in_and_is_named():
    (shown,) = shown_for([("g", 50.0)], [("3", 10.0), ("3", 40.0), ("0", 50.0)], True)
    assert (shown.texture, shown.speed_mm_s) == ("3", 40.0)
    assert shown.label == "g\n40 mm/s\n(for 50)"
    assert instead_of([shown]).endswith("session lacks: g at 40 mm/s for 50 mm/s. ")


def test_other_textures_stand_in_by_their_place():
    recorded = [(name, 20.0) for name in ("cotton", "denim", "silk", "wool", "zinc")]
    shown = shown_for([("a", 50.0), ("g", 50.0), ("m", 50.0)], recorded, True)
    assert [one.texture for one in shown] == ["cotton", "silk", "zinc"]
    assert shown[0].wanted == "a, 50"


def test_frames_have_one_scale():
    recorded = [("0", 50.0), ("3", 10.0), ("3", 50.0), ("3", 100.0), ("6", 50.0)]
    figure = printed_images_figure(rows_of(recorded), "sa1", "Figure 8", "data", "-y")
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert len(images) == 6 * 10
    assert {image.get_clim() for image in images} == {(0.0, 1.0)}
    assert "one scale for all" in figure.axes[-1].get_ylabel()


def test_a_short_recording_has_fewer_frames():
    figure = printed_images_figure(rows_of([("0", 50.0)], 3), "sa1", "Figure 8", "data")
    assert len([axes for axes in figure.axes if axes.images]) == 6 * 3


def test_spectra_of_one_window_and_the_mean(spectra):
    one = spectra_figure(spectra, "data", "paper", one_scale=True)
    assert len(one.axes) == 15
    panel = one.axes[1]
    assert panel.get_title() == "40 mm/s (for a)"
    assert [line.get_label() for line in panel.lines] == ["mean over windows", "one window"]
    assert panel.lines[1].get_ydata().argmax() == 80
    assert len({axes.get_ylim() for axes in one.axes}) == 1
    assert "each texture its own scale" in spectra_figure(spectra, "data", "paper").get_supylabel()


def test_what_the_paper_has_no_matrices_of_keeps_its_own(results, summary):
    summary["models"]["order-te"] = summary["models"].pop("vib-te-aug")
    rows = results.predictions.replace("vib-te-aug", "order-te")
    found = replace(results, predictions=rows, found=Summary.model_validate(summary))
    assert confusion_figure(found, "order-te", "nested", "paper") is None
    assert [one.name for one in draw_pictures(found, FigureData(), "paper")][3:] == [
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

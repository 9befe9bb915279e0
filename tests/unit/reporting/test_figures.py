"""Figures of the data: what is chosen, and that lines and images show the right numbers."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from afferents.encodings.samples import concatenate, make_samples
from afferents.evaluation.results import Results
from afferents.evaluation.schemas import Summary
from afferents.reporting import spectra as drawn_spectra
from afferents.reporting.accuracy import reliability_figure, speed_figure
from afferents.reporting.choice import spread
from afferents.reporting.figures import FigureData, draw_pictures, save_pictures
from afferents.reporting.images import consecutive_frames, images_figure, textures_by_speed
from afferents.reporting.published import published_textures
from afferents.reporting.spectra import (
    amplitude_top,
    condition_spectrum,
    frequencies,
    spectra_figure,
    stretch_example,
    stretch_figure,
)
from afferents.reporting.style import save_figure

S = Summary.model_validate


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def peak(points):
    return points[points[:, 1].argmax(), 0]


@pytest.fixture(autouse=True)
def quick_stretch(monkeypatch):
    monkeypatch.setattr(drawn_spectra, "stretched_copies", stretched)


def stretched(example):
    """Nearest-bin stretch, enough to see where a line ends up."""
    middle = example.middle.values
    return {
        factor: middle[(np.arange(int(len(middle) * factor)) / factor).astype(int)]
        for factor in (0.5, 2.0)
    }


def test_example_is_the_papers_where_it_is_there(spectra):
    example = stretch_example(spectra)
    assert (example.texture, example.speed_mm_s) == ("4", 40.0)


def test_example_falls_back_to_another_texture(spectra):
    left = spectra[spectra["texture"].values == "3"]
    assert stretch_example(left).texture == "3"


def test_example_is_a_bumpy_drum_before_a_word_before_a_smooth_one(spectra):
    names = spectra["texture"].values
    for others, chosen in ((("0", "3"), "3"), (("0", "Linen"), "Linen"), (("0", "0"), "0")):
        renamed = np.where(names == "3", others[0], others[1])
        assert stretch_example(spectra.assign_coords(texture=("sample", renamed))).texture == chosen


def test_no_example_without_half_and_double(spectra):
    assert stretch_example(spectra[spectra["speed_mm_s"].values != 80.0]) is None


def test_figure07_puts_stretched_and_real_lines_at_the_same_true_frequency(spectra):
    example = stretch_example(spectra)
    figure = stretch_figure(example, "somewhere")
    upper, middle, lower = figure.axes
    assert peak(lines(upper)["recorded at 20 mm/s (2 windows)"]) == 40
    assert peak(lines(upper)["40 mm/s stretched by 0.5"]) == 40
    assert peak(lines(middle)["recorded at 40 mm/s (2 windows)"]) == 80
    assert peak(lines(lower)["recorded at 80 mm/s (2 windows)"]) == 160
    assert peak(lines(lower)["40 mm/s stretched by 2"]) == 160
    assert upper.get_xlim()[1] == min(200, example.middle["frequency"].max())


def test_figure07_says_how_its_copies_were_stretched(results, spectra):
    data = FigureData(spectra)
    (picture,) = (one for one in draw_pictures(results, data) if one.name == "figure07")
    assert "nested protocol: rebinned" in picture.figure.get_suptitle()
    assert "rebinned, as under the nested protocol" in picture.caption


def test_amplitude_axes_name_the_unit_of_the_response(spectra):
    with_units = spectra.assign_attrs(units="counts")
    example = stretch_example(with_units)
    assert stretch_figure(example, "x").axes[1].get_ylabel() == "amplitude (counts)"
    assert (
        spectra_figure(with_units, "x").get_supylabel() == "amplitude (counts), mean over windows"
    )
    assert spectra_figure(spectra, "x").get_supylabel() == "amplitude, mean over windows"


def test_frequencies_keep_the_spacing_for_any_length(spectra):
    example = stretch_example(spectra)
    np.testing.assert_allclose(frequencies(np.zeros(400), example.middle), np.arange(400))


def test_condition_spectrum_is_the_mean_over_windows_and_none_where_not_recorded(spectra):
    spectrum = condition_spectrum(spectra, "3", 20.0)
    assert spectrum.dims == ("frequency",)
    assert spectrum.attrs["n_windows"] == 2
    assert condition_spectrum(spectra, "3", 10.0) is None


def test_amplitude_axis_is_not_set_by_the_offset(spectra):
    spectrum = condition_spectrum(spectra, "3", 20.0).copy()
    spectrum[0] = 1e6
    assert amplitude_top([spectrum]) == pytest.approx(1.08)


def test_figure12_draws_true_frequencies_and_speeds_and_says_what_is_missing(spectra):
    gap = (spectra["texture"].values == "3") & (spectra["speed_mm_s"].values == 80.0)
    figure = spectra_figure(spectra[~gap], "somewhere")
    assert [axes.get_title() for axes in figure.axes[:3]] == ["20 mm/s", "40 mm/s", "80 mm/s"]
    assert peak(figure.axes[0].lines[0].get_xydata()) == 40
    assert [text.get_text() for text in figure.axes[2].texts] == ["not recorded"]


def test_panel_a_takes_the_middle_frame_and_leaves_gaps(images):
    upper, lower = textures_by_speed(images)
    assert [image.title for image in upper] == ["10 mm/s", "50 mm/s"]
    np.testing.assert_array_equal(upper[1].values, np.arange(140, 160).reshape(4, 5) + 1)
    assert np.isnan(lower[0].values).all()


def test_panel_b_is_ten_consecutive_frames_of_one_recording(images):
    run = consecutive_frames(images)
    assert [image.title for image in run] == [f"+{10 * i} ms" for i in range(10)]
    assert run[0].beside == "g\n50 mm/s"
    np.testing.assert_array_equal(run[0].values, np.arange(40, 60).reshape(4, 5) + 2)


def shown_images(figure):
    """Return the drawn images, each with its limits of colour, and where it stands."""
    return [
        (axes, axes.images[0].get_clim(), np.ma.compressed(axes.images[0].get_array()))
        for axes in figure.axes
        if axes.images
    ]


@pytest.mark.parametrize(("channel", "unit"), [("sa1", "SA-I (px)"), ("ra1", "RA-I (px/frame)")])
def test_each_row_of_images_has_a_scale_of_the_frames_it_shows(images, channel, unit):
    figure = images_figure(images, channel, "somewhere")
    drawn = shown_images(figure)
    for scale in {scale for _, scale, _ in drawn}:
        values = np.concatenate([v for _, one, v in drawn if one == scale])
        values = values[np.isfinite(values)]
        assert scale == pytest.approx(np.quantile(values, [0.01, 0.99]))
    assert len({scale for _, scale, _ in drawn}) == 3  # two textures, and the consecutive frames
    assert [axes.get_ylabel() for axes in figure.axes].count(unit) == 3
    assert any("column (x)" in axes.get_xlabel() for axes in figure.axes)


@pytest.mark.parametrize("n_speeds", [1, 5, 7])
def test_images_fill_their_figure_whatever_the_number_of_speeds(n_speeds):
    time = np.arange(14) / 100
    samples = concatenate(
        [
            make_samples(
                np.random.default_rng(0).random((14, 3, 3), np.float32),
                ("row", "column"), time, time,
                {"texture": texture, "speed_mm_s": speed, "name": f"{texture}/{speed:g}"},
            )
            for texture in ("0", "2", "4", "6")
            for speed in 10.0 * np.arange(1, n_speeds + 1)
        ]
    )  # fmt: skip
    figure = images_figure(samples, "sa1", "somewhere")
    shape = figure.axes[0].get_subplotspec().get_gridspec().get_geometry()
    assert len(shown_images(figure)) == shape[0] * shape[1]


def test_rows_point_down(images):
    figure = images_figure(images, "sa1", "somewhere")
    bottom, top = next(axes for axes in figure.axes if axes.images).get_ylim()
    assert bottom > top


def panel_of(figure, title):
    return next(axes for axes in figure.axes if axes.get_title(loc="left") == title)


def test_speed_figure_draws_percent_and_the_interval_of_each_speed(results):
    panel = panel_of(speed_figure(results.found), "vib-TE")
    np.testing.assert_allclose(lines(panel)["nested protocol"], [[10, 25], [20, 50], [40, 75]])
    bars, shifted = panel.collections
    assert bars.get_segments()[0].tolist() == pytest.approx(np.array([[10, 15], [10, 35]]))
    assert shifted.get_segments()[0][0, 0] > 10  # both protocols' would hide each other
    caption = draw_pictures(results, FigureData())[0].caption
    assert "95% intervals, drawn over 3 textures, each with all its speeds" in caption
    assert "Open: published protocol" in caption


def test_captions_name_the_marks_that_are_drawn(results, summary):
    for protocols in summary["models"].values():
        del protocols["published"]
    nested = replace(results, found=S(summary))
    assert not any("Open" in picture.caption for picture in draw_pictures(nested, FigureData()))


def test_crosses_of_the_paper_only_where_the_textures_are_its_own(results, summary):
    crosses = "paper, its own recordings"
    first = draw_pictures(results, FigureData())[0]
    panel = panel_of(first.figure, "vib-TE")
    assert crosses not in lines(panel)
    assert panel.get_xticks().max() >= 40  # mm/s, not the number of a group
    assert "Crosses" not in first.caption
    summary["textures"] = list(published_textures())
    ours = results.predictions.replace("Linen", "6")
    first = draw_pictures(replace(results, predictions=ours, found=S(summary)), FigureData())[0]
    np.testing.assert_allclose(lines(panel_of(first.figure, "vib-TE"))[crosses][0], [10, 16.8])
    assert "Crosses" in first.caption


def test_marks_of_reliability_lie_where_the_bins_are_and_nothing_over_them(summary):
    bins = {"ece": 0.1, "count": [0, 30, 10], "confidence": [0, 0.5, 0.9], "accuracy": [0, 0.4, 1]}
    summary["models"]["vib-te"]["nested"]["reliability"] = bins
    panel = panel_of(reliability_figure(S(summary)), "vib-TE")
    marks = panel.collections[0]
    np.testing.assert_allclose(marks.get_offsets(), [[50, 40], [90, 100]])
    assert marks.get_sizes()[0] == pytest.approx(3 * marks.get_sizes()[1])
    assert not panel.texts
    assert panel.get_title(loc="right") == "ECE 10.0 and 20.0%"


def test_models_without_probabilities_have_no_reliability(results, summary):
    for protocols in summary["models"].values():
        for found in protocols.values():
            found["reliability"] = None
    names = [one.name for one in draw_pictures(replace(results, found=S(summary)), FigureData())]
    assert "reliability" not in names


def test_figures_of_the_paper_stand_in_its_order(results, summary):
    models = ("fusion", "sa-se", "ra-se", "sa-ste")
    summary["models"] = dict.fromkeys(models, summary["models"]["vib-te"])
    rows = results.predictions[results.predictions["model"] == "vib-te"]
    named = pd.concat([rows.assign(model=name) for name in models])
    found = Results(results.root, {}, S(summary), named)
    pictures = draw_pictures(found, FigureData())
    numbers = [picture.title.split(".")[0] for picture in pictures[3:]]
    assert numbers[:-2] == [f"Figure {n}" for n in ("9A", "9A", "9B", "9B", "11A", "11A")]
    assert all(one.startswith("fusion") for one in numbers[-2:])


def test_without_spectra_and_images_only_results_are_drawn(results):
    names = [picture.name for picture in draw_pictures(results, FigureData())]
    assert names == [
        "accuracy-by-speed",
        "accuracy-by-texture",
        "reliability",
        "confusion-vib-te-nested",
        "confusion-vib-te-published",
        "confusion-vib-te-aug-nested",
        "confusion-vib-te-aug-published",
    ]


def test_with_everything_all_figures_are_drawn_and_saved_as_png(results, spectra, images, tmp_path):
    data = FigureData(spectra, {"sa1": images, "ra1": images})
    pictures = draw_pictures(results, data)
    names = {picture.name for picture in pictures}
    assert {"figure07", "figure08", "figure10", "figure12"} <= names
    (path,) = save_pictures(pictures[:1], tmp_path / "figures")
    assert path.read_bytes().startswith(b"\x89PNG")
    assert save_figure(pictures[0].figure, tmp_path / "again.png").stat().st_size > 1000


@pytest.mark.parametrize(("most", "chosen"), [(9, [1, 2, 3, 4]), (2, [1, 4]), (3, [1, 3, 4])])
def test_spread_keeps_both_ends(most, chosen):
    assert spread([1, 2, 3, 4], most) == chosen


def captions(results, spectra, images, sliding):
    data = FigureData(spectra, {"sa1": images, "ra1": images}, sliding)
    drawn = {one.name: one for one in draw_pictures(results, data)}
    return {name: drawn[name].caption for name in ("figure08", "figure10", "figure12")}


def test_an_arrow_only_where_a_direction_is_declared(results, spectra, images):
    assert "the arrow is the sliding" in captions(results, spectra, images, "-y")["figure08"]
    assert "arrow" not in captions(results, spectra, images, "")["figure10"]
    for sliding, said in (("", []), ("+x", ["sliding +x"])):
        figure = images_figure(images, "sa1", "somewhere", sliding)
        labels = "\n".join(axes.get_xlabel() for axes in figure.axes)
        assert [line for line in labels.splitlines() if "sliding" in line] == said
        arrows = [t for axes in figure.axes for t in axes.texts if getattr(t, "arrow_patch", None)]
        assert len(arrows) == len(said)


def test_the_papers_misprint_is_of_no_matter_to_other_textures(results, spectra, images):
    assert "mislabelled" in captions(results, spectra, images, "")["figure12"]
    del spectra.attrs["named_by_spacing"]
    assert "paper" not in captions(results, spectra, images, "")["figure12"]
    names = [axes.get_ylabel() for axes in spectra_figure(spectra, "x").axes]
    assert [name for name in names if name] == ["3", "4"]

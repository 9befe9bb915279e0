"""Figures of the data: what is chosen, and that lines and images show the right numbers."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from afferents.encodings.samples import concatenate, make_samples
from afferents.reporting.accuracy_figures import speed_figure
from afferents.reporting.choice import spread
from afferents.reporting.images import consecutive_frames, figure08, figure10, textures_by_speed
from afferents.reporting.pictures import FigureData, draw_pictures, save_pictures
from afferents.reporting.published import published_textures
from afferents.reporting.spectra import (
    amplitude_top,
    condition_spectrum,
    figure07,
    figure12,
    frequencies,
    stretch_example,
)
from afferents.reporting.style import save_figure


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def peak(points):
    return points[points[:, 1].argmax(), 0]


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
    figure = figure07(example, stretched(example), "somewhere")
    upper, middle, lower = figure.axes
    assert peak(lines(upper)["recorded at 20 mm/s (2 windows)"]) == 40
    assert peak(lines(upper)["40 mm/s stretched by 0.5"]) == 40
    assert peak(lines(middle)["recorded at 40 mm/s (2 windows)"]) == 80
    assert peak(lines(lower)["recorded at 80 mm/s (2 windows)"]) == 160
    assert peak(lines(lower)["40 mm/s stretched by 2"]) == 160
    assert upper.get_xlim()[1] == min(200, example.middle["frequency"].max())


def test_figure07_says_how_its_copies_were_stretched(results, spectra):
    example = stretch_example(spectra)
    data = FigureData(example=example, stretched=stretched(example))
    (picture,) = (one for one in draw_pictures(results, data) if one.name == "figure07")
    assert "nested protocol: rebinned" in picture.figure.get_suptitle()
    assert "rebinned, as under the nested protocol" in picture.caption


def test_amplitude_axes_name_the_unit_of_the_response(spectra):
    with_units = spectra.assign_attrs(units="counts")
    example = stretch_example(with_units)
    assert figure07(example, stretched(example), "x").axes[1].get_ylabel() == "amplitude (counts)"
    assert figure12(with_units, "x").get_supylabel() == "amplitude (counts), mean over windows"
    assert figure12(spectra, "x").get_supylabel() == "amplitude, mean over windows"


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
    assert amplitude_top([spectrum, None]) == pytest.approx(1.08)


def test_figure12_draws_true_frequencies_and_speeds_and_says_what_is_missing(spectra):
    gap = (spectra["texture"].values == "3") & (spectra["speed_mm_s"].values == 80.0)
    figure = figure12(spectra[~gap], "somewhere")
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


@pytest.mark.parametrize(("draw", "unit"), [(figure08, "SA-I (px)"), (figure10, "RA-I (px/frame)")])
def test_each_row_of_images_has_a_scale_of_the_frames_it_shows(images, draw, unit):
    figure = draw(images, "somewhere")
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
    figure = figure08(samples, "somewhere")
    shape = figure.axes[0].get_subplotspec().get_gridspec().get_geometry()
    assert len(shown_images(figure)) == shape[0] * shape[1]


def test_rows_point_down(images):
    figure = figure08(images, "somewhere")
    bottom, top = next(axes for axes in figure.axes if axes.images).get_ylim()
    assert bottom > top


def test_speed_figure_draws_percent_by_speed_and_passes_over_untested_speeds(summary):
    summary["models"]["vib-te"]["nested"]["by_speed"]["20"] = None
    panel = panel_of(speed_figure(summary), "vib-TE")
    np.testing.assert_allclose(lines(panel)["nested protocol"], [[10, 25], [40, 75]])


def panel_of(figure, title):
    return next(axes for axes in figure.axes if axes.get_title(loc="left") == title)


def test_crosses_of_the_paper_only_where_the_textures_are_its_own(results):
    crosses = "paper, its own recordings"
    first = draw_pictures(results, FigureData())[0]
    panel = panel_of(first.figure, "vib-TE")
    assert crosses not in lines(panel)
    assert panel.get_xticks().max() >= 40  # mm/s, not the number of a group
    assert "Crosses" not in first.caption
    results.summary["textures"] = list(published_textures())
    ours = results.predictions.replace("Linen", "6")
    first = draw_pictures(replace(results, predictions=ours), FigureData())[0]
    np.testing.assert_allclose(lines(panel_of(first.figure, "vib-TE"))[crosses][0], [10, 16.8])
    assert "Crosses" in first.caption


def test_speed_figure_has_the_intervals_of_each_speed(results):
    before = panel_of(speed_figure(results.summary), "vib-TE")
    assert not before.collections  # earlier results have none
    results.summary["intervals"] = {"replicate": "texture", "n": 3}
    found = results.summary["models"]["vib-te"]["nested"]
    found["ci95_by_speed"] = {"10": [0.1, 0.4], "40": [0.6, 0.9]}
    picture = draw_pictures(results, FigureData())[0]
    (bars,) = panel_of(picture.figure, "vib-TE").collections
    np.testing.assert_allclose(bars.get_segments(), [[[10, 10], [10, 40]], [[40, 60], [40, 90]]])
    assert "95% intervals, drawn over 3 textures, each with all its speeds" in picture.caption


def test_figures_of_the_paper_stand_in_its_order(results):
    models = ("fusion", "sa-se", "ra-se", "sa-ste")
    results.summary["models"] = dict.fromkeys(models, results.summary["models"]["vib-te"])
    rows = results.predictions[results.predictions["model"] == "vib-te"]
    named = [rows.assign(model=name) for name in results.summary["models"]]
    pictures = draw_pictures(replace(results, predictions=pd.concat(named)), FigureData())
    numbers = [picture.title.split(".")[0] for picture in pictures[2:]]
    assert numbers[:-2] == [f"Figure {n}" for n in ("9A", "9A", "9B", "9B", "11A", "11A")]
    assert all(one.startswith("fusion") for one in numbers[-2:])


def test_without_spectra_and_images_only_results_are_drawn(results):
    names = [picture.name for picture in draw_pictures(results, FigureData())]
    assert names == [
        "accuracy-by-speed",
        "accuracy-by-texture",
        "confusion-vib-te-nested",
        "confusion-vib-te-published",
        "confusion-vib-te-aug-nested",
        "confusion-vib-te-aug-published",
    ]


def test_with_everything_all_figures_are_drawn(results, spectra, images):
    example = stretch_example(spectra)
    data = FigureData(spectra, example, stretched(example), images, images)
    names = {picture.name for picture in draw_pictures(results, data)}
    assert {"figure07", "figure08", "figure10", "figure12"} <= names


def test_figures_are_saved_as_png(results, tmp_path):
    pictures = draw_pictures(results, FigureData())[:1]
    (path,) = save_pictures(pictures, tmp_path / "figures")
    assert path.read_bytes().startswith(b"\x89PNG")
    assert save_figure(pictures[0].figure, tmp_path / "again.png").stat().st_size > 1000


@pytest.mark.parametrize(("most", "chosen"), [(9, [1, 2, 3, 4]), (2, [1, 4]), (3, [1, 3, 4])])
def test_spread_keeps_both_ends(most, chosen):
    assert spread([1, 2, 3, 4], most) == chosen


def captions(results, spectra, images, sliding):
    data = FigureData(spectra=spectra, sa1_images=images, ra1_images=images, sliding=sliding)
    drawn = {one.name: one for one in draw_pictures(results, data)}
    return {name: drawn[name].caption for name in ("figure08", "figure10", "figure12")}


def test_an_arrow_only_where_a_direction_is_declared(results, spectra, images):
    assert "the arrow is the sliding" in captions(results, spectra, images, "-y")["figure08"]
    assert "arrow" not in captions(results, spectra, images, "")["figure10"]
    for sliding, said in (("", []), ("+x", ["sliding +x"])):
        figure = figure08(images, "somewhere", sliding)
        labels = "\n".join(axes.get_xlabel() for axes in figure.axes)
        assert [line for line in labels.splitlines() if "sliding" in line] == said
        arrows = [t for axes in figure.axes for t in axes.texts if getattr(t, "arrow_patch", None)]
        assert len(arrows) == len(said)


def test_the_papers_misprint_is_of_no_matter_to_other_textures(results, spectra, images):
    assert "mislabelled" in captions(results, spectra, images, "")["figure12"]
    del spectra.attrs["named_by_spacing"]
    assert "paper" not in captions(results, spectra, images, "")["figure12"]
    names = [axes.get_ylabel() for axes in figure12(spectra, "x").axes]
    assert [name for name in names if name] == ["3", "4"]

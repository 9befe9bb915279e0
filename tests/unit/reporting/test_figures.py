"""Figures of the data: what is chosen, and that lines and images show the right numbers."""

import numpy as np
import pytest

from afferents.reporting import (
    FigureData,
    draw_pictures,
    figure07,
    figure08,
    figure10,
    figure12,
    save_figure,
    save_pictures,
    speed_figure,
    stretch_example,
)
from afferents.reporting.choice import spread
from afferents.reporting.images import consecutive_frames, textures_by_speed
from afferents.reporting.spectra import amplitude_top, condition_spectrum, frequencies


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


def test_figure07_says_how_its_copies_were_stretched(results, spectra):
    example = stretch_example(spectra)
    data = FigureData(example=example, stretched=stretched(example))
    picture = draw_pictures(results, data)[-1]
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
    assert run[0].beside == "g (3 mm)\n50 mm/s"
    np.testing.assert_array_equal(run[0].values, np.arange(40, 60).reshape(4, 5) + 2)


@pytest.mark.parametrize(("draw", "unit"), [(figure08, "SA-I (px)"), (figure10, "RA-I (px/frame)")])
def test_image_figures_share_one_scale_of_the_frames_shown(images, draw, unit):
    figure = draw(images, "somewhere")
    scales = {axes.images[0].get_clim() for axes in figure.axes if axes.images}
    assert len(scales) == 1
    low, high = scales.pop()
    shown = np.concatenate(
        [np.ma.compressed(axes.images[0].get_array()) for axes in figure.axes if axes.images]
    )
    shown = shown[np.isfinite(shown)]
    assert (low, high) == (shown.min(), shown.max())
    assert unit in [axes.get_ylabel() for axes in figure.axes]
    assert any("column (x)" in axes.get_xlabel() for axes in figure.axes)


def test_rows_point_down(images):
    figure = figure08(images, "somewhere")
    bottom, top = next(axes for axes in figure.axes if axes.images).get_ylim()
    assert bottom > top


def test_speed_figure_draws_percent_by_speed_and_passes_over_untested_speeds(summary):
    summary["models"]["vib-te"]["nested"]["by_speed"]["20"] = None
    figure = speed_figure(summary)
    panel = next(axes for axes in figure.axes if axes.get_title(loc="left") == "vib-TE")
    np.testing.assert_allclose(lines(panel)["nested protocol"], [[10, 25], [40, 75]])
    np.testing.assert_allclose(lines(panel)["paper, its own recordings"][0], [10, 16.8])


def test_without_spectra_and_images_only_results_are_drawn(results):
    names = [picture.name for picture in draw_pictures(results, FigureData())]
    assert names == [
        "accuracy-by-speed",
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

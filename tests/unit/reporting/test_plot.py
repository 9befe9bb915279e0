"""Plots draw what they are given, on axes with units, and refuse what lacks a dimension."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib import pyplot

from afferents import plot
from afferents.errors import InputError
from afferents.markers.places import image_places
from afferents.markers.sensor import load_sensor
from afferents.store.recording import Frame


@pytest.fixture(autouse=True)
def closed():
    yield
    pyplot.close("all")


@pytest.fixture
def felt():
    """Three frames of a 2 x 2 grid whose marker at row 1, column 0 was lost in the last one."""
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    values[2, 2] = np.nan
    row, column = ("marker", [0, 0, 1, 1]), ("marker", [1, 0, 0, 1])
    coords = {"time": [0.0, 0.5, 1.0], "row": row, "column": column}
    of_markers = ("time", "marker")
    position = np.stack([values + 10, values + 20], axis=-1)
    hum = np.sin(2 * np.pi * 50 * np.arange(2000) / 1000).astype(np.float32)[:, np.newaxis]
    about = {"sample_rate_hz": 1000.0, "units": "full scale"}
    return xr.Dataset(
        {
            "sa1": xr.DataArray(values, coords, of_markers, attrs={"units": "px"}),
            "position": ((*of_markers, "space"), position),
            "detected": (of_markers, ~np.isnan(values)),
            "ra2": (("audio_time", "channel"), hum, about),
        }
    )


def image_of(ax):
    return np.ma.filled(ax.images[0].get_array(), np.nan)


def labels_of(ax):
    return ax.get_xlabel(), ax.get_ylabel()


def test_a_tactile_image_puts_every_marker_at_its_row_and_column(felt):
    ax = plot.tactile_image(felt.sa1, time_s=0.4)
    np.testing.assert_array_equal(image_of(ax), [[5, 4], [6, 7]])
    assert ax.yaxis_inverted()
    assert ax.get_title() == "0.50 s"
    assert ax.figure.axes[1].get_ylabel() == "SA-I (px)"


def test_a_lost_marker_is_drawn_as_its_neighbours_let_expect(felt):
    """Two of them are as far as a side, 8 and 11 px, one as a diagonal, 9 px, and counts half."""
    filled = image_of(plot.tactile_image(felt.sa1.isel(time=-1)))
    np.testing.assert_allclose(filled, [[9, 8], [(9 + 11 + 8 / 2) / 2.5, 11]], rtol=1e-6)
    unseen = image_of(plot.tactile_image(felt.sa1.isel(time=-1) * np.nan))
    assert np.isnan(unseen).all()


def test_without_a_time_the_strongest_frame_is_drawn_on_a_scale_that_no_outlier_sets(felt):
    sa1 = felt.sa1.copy(data=[[0, 0, 0, 99], [5, 5, 6, 6], [1, 1, 1, 1]])
    np.testing.assert_array_equal(image_of(plot.tactile_image(sa1)), [[5, 5], [6, 6]])
    unseen = plot.tactile_image(felt.sa1.where(felt.time > 0))  # as RA-I of the first frame
    assert unseen.get_title() == "1.00 s"
    one = np.ones(400, np.float32)
    one[7] = 1000
    image = xr.DataArray(one.reshape(20, 20), dims=("row", "column"))
    assert plot.tactile_image(image).images[0].get_clim()[1] < 2


def test_of_a_hexagon_the_corners_stay_blank():
    places = image_places(np.array(load_sensor("hex127").markers))
    coords = {"row": ("marker", places[0]), "column": ("marker", places[1])}
    drawn = image_of(plot.tactile_image(xr.DataArray(np.ones(127), dims="marker", coords=coords)))
    assert np.isnan(drawn[[0, 0, -1, -1], [0, -1, 0, -1]]).all()
    np.testing.assert_allclose(drawn[~np.isnan(drawn)], 1, atol=1e-5)
    assert np.isfinite(drawn).sum() > 100


def test_markers_are_drawn_at_the_frame_s_time_and_the_lost_are_told_apart(felt):
    frame = Frame(1.0, np.zeros((40, 60), np.uint8))
    ax = plot.markers(felt, frame)
    assert ax.get_title(loc="left") == "3 of 4 markers, 1.00 s"
    assert labels_of(ax) == ("x (px) →", "← y (px)")
    np.testing.assert_array_equal(ax.collections[0].get_offsets()[0], [18, 28])
    felt.detected[1, 0] = False
    ax = plot.markers(felt, time_s=0.5)
    assert ax.yaxis_inverted()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["detected", "not detected"]


def test_responses_are_drawn_over_seconds_in_their_unit_and_leave_no_look_behind(felt):
    before = dict(pyplot.rcParams)
    _, (above, below) = pyplot.subplots(2)
    assert plot.responses(felt.sa1, ax=above) is above
    assert labels_of(above) == ("time (s)", "SA-I (px)")
    np.testing.assert_allclose(above.lines[0].get_ydata(), felt.sa1.mean("marker"))
    plot.responses(felt.ra2, ax=below)
    assert labels_of(below) == ("time (s)", "RA-II (full scale)")
    assert below.lines[0].get_xdata()[-1] == pytest.approx(1.999)
    assert dict(pyplot.rcParams) == before


def test_a_spectrum_peaks_where_the_vibration_does(felt):
    ax = plot.spectrum(felt.ra2)
    (line,) = ax.lines
    assert line.get_xdata()[np.argmax(line.get_ydata())] == 50
    assert line.get_ydata().max() == pytest.approx(1)
    assert labels_of(ax) == ("frequency (Hz)", "amplitude (full scale)")


def test_a_confusion_matrix_is_of_the_rows_chosen(results):
    ax = plot.confusion(results, model="vib-te", protocol="nested")
    drawn = image_of(ax)
    np.testing.assert_allclose(np.nansum(drawn, axis=0), 100)
    rows = results.predictions.query("model == 'vib-te' and protocol == 'nested'")
    right = 100 * (rows["true_texture"] == rows["predicted_texture"]).mean()
    assert ax.get_title() == f"vib-TE, nested protocol, {right:.0f}%"
    assert "true texture" in ax.get_xlabel()
    again = plot.confusion(rows)
    np.testing.assert_array_equal(image_of(again), drawn)
    with pytest.raises(InputError, match=r"protocol: expected one of .*, found none chosen"):
        plot.confusion(results, model="vib-te")
    slow = plot.confusion(rows, held_out_mm_s=10)
    assert "10 mm/s held out" in slow.get_title()


def test_accuracy_is_drawn_against_the_speeds_held_out(results):
    ax = plot.accuracy_by_speed(results, models=["vib-te"])
    assert labels_of(ax) == ("held-out speed (mm/s)", "accuracy (%)")
    found = {line.get_label(): line.get_xydata() for line in ax.lines}
    assert set(found) == {"vib-TE, nested", "vib-TE, published", "chance"}
    np.testing.assert_allclose(found["vib-TE, nested"], [[10, 25], [20, 50], [40, 75]])


@pytest.mark.parametrize(
    ("draw", "sentence"),
    [
        (lambda d: plot.tactile_image(d), "one xarray.DataArray, such as responses.sa1, found a"),
        (lambda d: plot.tactile_image(d.ra2), r"or \(marker\), found \(audio_time, channel\)"),
        (lambda d: plot.tactile_image(d.sa1.drop_vars(["row", "column"])), "markers in a grid"),
        (lambda d: plot.markers(d, np.zeros((4, 4, 3))), r"grey image .*found shape \(4, 4, 3\)"),
        (lambda d: plot.responses(d.ra2.drop_attrs()), "the attribute 'sample_rate_hz'"),
        (lambda d: plot.spectrum(d.sa1), r"one 'frequency', found \(time, marker\)"),
        (lambda d: plot.confusion(pd.DataFrame()), "a table with the column 'true_texture'"),
        (lambda d: plot.accuracy_by_speed(d), "a table of theirs, found Dataset"),
    ],
)
def test_what_is_missing_is_named_in_one_sentence(felt, draw, sentence):
    with pytest.raises(InputError, match=sentence):
        draw(felt)

"""Fingertips without markers: SA-I of the cells of a picture, in grey levels."""

import json
import re

import numpy as np
import pytest

from afferents import dims
from afferents.channels import CHANNELS
from afferents.errors import InputError
from afferents.extraction.extract import marker_responses
from afferents.inspection.files import inspect_video
from afferents.markers.calibrate import sensor_toml
from afferents.markers.quality import describe
from afferents.markers.sensor import Sensor, load_sensor
from afferents.markers.track import track_markers
from afferents.progress import Progress
from afferents.rig.sensor_rig import make_rig
from afferents.spikes.artificial import artificial_spikes

from ..films import write_film

CELLS = 'name = "plain"\nlayout = "cells"\nrows = 4\ncolumns = 5\nrest_frame = 0\n'
AREA = np.s_[40:60, 32:48]
"""Of the cell in row 2 and column 2 of a picture 80 x 80 px."""


@pytest.fixture
def write(tmp_path):
    def write_file(more=""):
        path = tmp_path / "cells.toml"
        path.write_text(CELLS + more)
        return path

    return write_file


@pytest.fixture
def plain(write):
    return load_sensor(write())


def film(n=30, touched=20, by=10):
    """Pictures with noise that is the same in all; from one on a cell is brighter."""
    still = np.random.default_rng(0).integers(60, 180, (80, 80)).astype(np.uint8)
    bright = still.copy()
    bright[AREA] = bright[AREA].astype(int) + by
    return [bright if i >= touched else still for i in range(n)]


def test_a_brighter_cell_is_felt_there_alone(video, plain):
    tracks = track_markers(video(film()), plain)
    found = marker_responses(tracks, plain)
    here = (found[dims.ROW] == 2) & (found[dims.COLUMN] == 2)
    assert found.sizes == {"time": 30, "marker": 20, "space": 2}
    expected = np.where(here, 10.0, 0.0) * (np.arange(30) >= 20)[:, None]
    np.testing.assert_array_equal(found.sa1, expected)
    np.testing.assert_array_equal(
        found.ra1[1:], np.where(here, 10.0, 0.0) * (np.arange(1, 30) == 20)[:, None]
    )
    assert (found.sa1.units, found.ra1.units) == ("grey levels", "grey levels/frame")
    np.testing.assert_array_equal(found.rest_position[here], [[39.5, 49.5]])
    assert (found.position == found.rest_position).all()
    assert found.detected.all()
    assert "20 cells" in describe(tracks)[0]


def test_frames_of_an_earlier_run_are_left_out(video, plain):
    earlier = [np.full((80, 80), 20 * i, np.uint8) for i in (3, 2, 2, 2)]
    found = track_markers(video(earlier + film()), plain)
    assert found.attrs["rest_frame"] == 7
    assert found.sa1[7:24].max() == 0
    assert np.isnan(found.sa1[:7]).all()


def flashed():
    return [film()[0], np.zeros((80, 80), np.uint8), *film()[2:]]


def moving():
    base = film()[0]
    return [base] * 3 + [np.roll(base, i, axis=1) for i in range(30)]


@pytest.mark.parametrize(
    ("pictures", "part", "most"),
    [
        (film(by=-10), slice(None), 10),  # darker counts as brighter does
        (flashed(), slice(2, 20), 0),  # rest is the median of the first frames,
        (moving(), slice(4), 0),  # of those in which the skin stands still
        (film(touched=5), slice(None), 10),  # and a touch among them is no earlier run
    ],
    ids=["darker", "flash", "moving", "touched early"],
)
def test_rest_is_what_stands_still_at_first(video, plain, pictures, part, most):
    found = track_markers(video(pictures), plain)
    assert found.sa1[part].max() == most
    assert found.attrs["rest_frame"] == 0


def test_a_turned_picture_has_rows_and_columns_as_it_stands_upright(video, write):
    sensor = load_sensor(write("width = 80\nheight = 60\n[picture]\nturn = 90\n"))
    pictures = [np.zeros((60, 80), np.uint8) for _ in range(25)]
    pictures[-1] = pictures[-1].copy()
    pictures[-1][:12, :20] = 50  # on the left above; turned clockwise, on the right above
    found = marker_responses(track_markers(video(pictures), sensor), sensor)
    here = found.isel(marker=int(found.sa1.values[-1].argmax()))
    assert (int(here.row), int(here.column), float(here.sa1[-1])) == (0, 4, 50)
    np.testing.assert_allclose(here.position[-1], [53.5, 9.5])
    assert float(found.sa1[-1].sum()) == 50


def test_cells_without_a_pixel_are_left_out(video, write):
    sensor = load_sensor(write("[picture]\nhide = [[0, 0, 30]]\nkeep = [39.5, 39.5, 55]\n"))
    found = track_markers(video(film()), sensor)
    assert found.sizes[dims.MARKER] == 19
    assert (int(found.row[0]), int(found.column[0])) == (0, 1)
    assert found.sa1.max() == 10


def test_too_few_cells_are_refused(video, write):
    sensor = load_sensor(write("[picture]\nhide = [[39.5, 39.5, 50]]\n"))
    with pytest.raises(InputError, match=r"expected 6 cells or more of sensor 'plain'.*found 4"):
        track_markers(video(film()), sensor)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("rows = 4", "rows = 3", "rows of cells must be 4 to 200, found 3"),
        ("columns = 5", "columns = 2", "columns of cells must be 4 to 200, found 2"),
        ("columns = 5", "columns = 201", "columns of cells must be 4 to 200, found 201"),
        ("rows = 4\n", "", "rows of cells must be 4 to 200, found none"),
        ("rest_frame", "[detector]\nradius_px = 4\n#", "cells have no detector; leave it out"),
        ("rows", "n_markers = 20\nrows", "cells have no n_markers; leave it out"),
        ('"cells"', '"square"\nn_markers = 20', "a square layout needs a [detector]"),
    ],
)
def test_bad_files_are_refused(write, old, new, complaint):
    path = write()
    path.write_text(CELLS.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(complaint)) as caught:
        load_sensor(path)
    assert str(path) in str(caught.value)


def test_a_sensor_file_is_written_as_it_was_read(plain, tmp_path):
    (tmp_path / "again.toml").write_text(sensor_toml(plain))
    assert load_sensor(tmp_path / "again.toml") == plain
    assert Sensor.model_validate(json.loads(plain.model_dump_json())) == plain


@pytest.mark.parametrize("name", [dims.SA1_VECTOR, dims.RA1_VECTOR, dims.SHEAR, dims.SA1_LOCAL])
def test_cells_have_no_displacement(video, plain, name):
    responses = marker_responses(track_markers(video(film()), plain), plain)
    with pytest.raises(InputError, match="found cells, which have none; take sa1 or ra1"):
        CHANNELS[name].response(responses)


def test_what_needs_markers_says_so(video, plain):
    with pytest.raises(InputError, match="--tracker published: expected a sensor with markers"):
        track_markers(video(film()), plain, "published")
    with pytest.raises(InputError, match="--rest reference: expected a sensor with markers"):
        track_markers(video(film()), plain, count_from=np.zeros((20, 2)))
    with pytest.raises(InputError, match="expected one with markers, found sensor 'plain'"):
        make_rig(plain)
    responses = marker_responses(track_markers(video(film(90)), plain), plain)
    responses = responses.assign_attrs(name="a/1", texture="a", speed_mm_s=1.0)
    with pytest.raises(InputError, match=r"a/1: expected sa1 in px.*choose --classes PC"):
        artificial_spikes([responses], classes=["SA"])


def test_inspect_says_what_cells_tell(plain, tmp_path):
    path = write_film(tmp_path / "plain.mkv", film(), codec="ffv1", pixels="gray")
    found = inspect_video(path, tmp_path / "out", plain, Progress(quiet=True))
    assert any("not how far the skin moves" in sentence for sentence in found.sentences)
    assert "largest_displacement_px" not in found.facts
    assert [picture.name for picture in found.pictures] == ["markers.png", "responses.png"]

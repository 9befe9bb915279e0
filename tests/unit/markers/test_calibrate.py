"""From a clip at rest to a sensor file that finds its markers again."""

import cv2
import numpy as np
import pytest

from afferents import dims
from afferents.errors import InputError
from afferents.inspection.calibrate import describe
from afferents.markers.calibrate import calibrate_from_clips, sensor_toml
from afferents.markers.sensor import Picture, load_sensor
from afferents.markers.track import track_markers

from .conftest import lay_grid


@pytest.fixture
def grid():
    return lay_grid(6, 8, 28, 50)


@pytest.fixture
def rings():
    """A middle and three rings, 37 markers."""
    parts = [np.zeros((1, 2))]
    for k in (1, 2, 3):
        angle = np.arange(6 * k) * np.pi / (3 * k) + 0.3 * k
        parts.append(28 * k * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(parts) + np.array([160, 120])


def written(found, tmp_path):
    (tmp_path / "mine.toml").write_text(sensor_toml(found.sensor))
    return load_sensor(tmp_path / "mine.toml")


def test_a_square_sensor_is_described_whole(draw, video, grid, tmp_path):
    clip = video([draw(grid)] * 9)
    with pytest.raises(InputError, match="--pitch-mm: expected a distance above 0, mm"):
        calibrate_from_clips(clip, "mine", pitch_mm=-1.0)
    found = calibrate_from_clips(clip, "mine", pitch_mm=1.4)
    sensor = written(found, tmp_path)
    assert (sensor.layout, sensor.rows, sensor.columns) == ("square", 6, 8)
    assert (sensor.name, sensor.pitch_mm, sensor.n_markers) == ("mine", 1.4, 48)
    assert sensor == found.sensor
    tracks = track_markers(video([draw(grid + np.array([t, 0])) for t in range(4)]), sensor)
    assert tracks[dims.DETECTED].all()


def test_a_square_sensor_with_a_broken_pin_is_square_still(draw, video, grid, tmp_path):
    found = calibrate_from_clips(video([draw(np.delete(grid, 20, axis=0))] * 9), "mine")
    sensor = written(found, tmp_path)
    assert (sensor.layout, sensor.rows, sensor.columns, sensor.n_markers) == ("square", 6, 8, 48)
    assert len(found.position) == 47


def test_a_free_layout_keeps_its_names_in_another_recording(draw, video, rings, tmp_path):
    sensor = written(calibrate_from_clips(video([draw(rings)] * 9), "mine"), tmp_path)
    assert len(sensor.markers) == 37
    middle = rings.mean(axis=0)
    angle = np.radians(9)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    seen = (rings - middle) @ turn + middle + (8, -5)
    tracks = track_markers(video([draw(seen)] * 3), sensor)
    names = np.array(sensor.markers)
    expected = (names - middle) @ turn + middle + (8, -5)
    np.testing.assert_allclose(tracks[dims.REST_POSITION].values, expected, atol=1.0)


@pytest.mark.parametrize(
    ("n", "sentence"), [(0, "found no frames"), (9, "at least 6 bright or dark")]
)
def test_a_clip_that_shows_no_sensor_at_rest_is_refused(n, sentence, draw, video):
    with pytest.raises(InputError, match=sentence):
        calibrate_from_clips(video([draw([])] * n), "mine")


def shaken(draw, position, spots, n_frames=24):
    """Return frames at rest, and then shaken to and fro by more than a spacing."""
    away = np.concatenate([np.zeros(10), 34 * np.sin(np.linspace(0, 2 * np.pi, n_frames))])
    return [draw(np.concatenate([position + np.array([x, 0]), spots])) for x in away]


def test_specks_beyond_the_layout_are_left_out_and_counted(draw, video, rings):
    specks = np.array([[20, 20], [296, 210], [300, 120]])
    found = calibrate_from_clips(video([draw(np.concatenate([rings, specks]))] * 12), "mine")
    assert len(found.position) == 37
    order = np.argsort(found.suspects[:, 0])
    np.testing.assert_allclose(found.suspects[order], specks, atol=0.5)
    assert (found.n_again, found.n_checked) == (37, 3)


def test_spots_that_stay_while_all_round_them_moves_are_left_out(draw, video, grid):
    spots = grid[[9, 28]] + 14
    found = calibrate_from_clips(video(shaken(draw, grid, spots)), "mine")
    np.testing.assert_allclose(found.suspects, spots, atol=0.5)
    assert (found.sensor.layout, found.sensor.n_markers) == ("square", 48)
    assert found.n_again == 48
    alone = calibrate_from_clips(video(shaken(draw, grid, np.zeros((0, 2)))), "mine")
    assert len(alone.suspects) == 0


def test_what_one_clip_hides_another_shows(draw, video, rings):
    shown = [np.delete(rings, k, axis=0) for k in ([5, 30], [12], [20, 21])]
    clips = [video([draw(each + np.array([3 * k, -2 * k]))] * 9) for k, each in enumerate(shown)]
    found = calibrate_from_clips(clips, "mine")
    assert found.sensor.n_markers == 37
    order = np.lexsort((rings[:, 0].round(), rings[:, 1].round()))
    ours = np.lexsort((found.position[:, 0].round(), found.position[:, 1].round()))
    np.testing.assert_allclose(found.position[ours], rings[order], atol=0.5)


def test_a_sensor_file_fits_a_clip_in_other_light(draw, video, rings, tmp_path):
    """One side lies in the dark: its markers stand out by a fifth of what the others do."""
    sensor = written(calibrate_from_clips(video([draw(rings)] * 9), "mine"), tmp_path)
    dark = draw(rings).astype(float)
    dark[:, 200:] = 20 + 0.2 * (dark[:, 200:] - 20)
    tracks = track_markers(video([np.rint(dark).astype(np.uint8)] * 12), sensor)
    assert tracks[dims.DETECTED][0].all()
    np.testing.assert_allclose(tracks[dims.REST_POSITION], np.array(sensor.markers), atol=0.5)


def test_a_flash_in_the_first_frame_hides_no_marker(draw, video, rings, tmp_path):
    """What one frame does not show, the median of those at rest does, for both commands."""
    images = [draw(rings) for _ in range(12)]
    images[0][60:180, 60:150] = 255
    sensor = written(calibrate_from_clips(video(images), "mine"), tmp_path)
    assert sensor.n_markers == 37
    assert track_markers(video(images), sensor)[dims.DETECTED][3:].mean() > 0.99


def test_clips_of_two_sensors_or_sizes_are_refused(draw, video, rings, grid):
    small = [draw(rings, shape=(230, 320))] * 9
    with pytest.raises(InputError, match=r"expected 320 x 240 px, as in drawn\.mp4"):
        calibrate_from_clips([video([draw(rings)] * 9), video(small)], "mine")
    with pytest.raises(InputError, match=r"expected the 37 markers of .*found \d+ of them"):
        calibrate_from_clips([video([draw(rings)] * 9), video([draw(grid)] * 9)], "mine")


NONE, ELSEWHERE = "6 bright or dark blobs of like size, found 0", r"found \d+ of \d+ blobs again"


@pytest.mark.parametrize(
    ("skin", "noise", "blur", "sentence"),
    [
        *((skin, noise, 0, NONE) for skin, noise in ((8, 2), (120, 6), (120, 20))),
        *((120, noise, blur, ELSEWHERE) for noise, blur in ((6, 2), (20, 1), (40, 4))),
    ],
)
def test_noise_is_no_sensor(skin, noise, blur, sentence, video):
    """The grain of a compressed video is as large as markers, but elsewhere in each frame."""
    grain = np.random.default_rng(1).normal(size=(12, 240, 320))
    if blur:
        grain = np.array([cv2.GaussianBlur(one, (0, 0), blur) for one in grain])
    images = np.clip(skin + noise * grain / np.std(grain), 0, 255).astype(np.uint8)
    with pytest.raises(InputError, match=sentence):
        calibrate_from_clips(video(images), "mine")


@pytest.mark.parametrize("noise", [2, 6])
@pytest.mark.parametrize(("rows", "columns"), [(2, 5), (1, 10)])
def test_ten_clear_markers_are_found_in_noise(rows, columns, noise, draw, video):
    markers = lay_grid(rows, columns, 28, 30)
    taken = draw(markers) + np.random.default_rng(1).normal(0, noise, (12, 240, 320))
    found = calibrate_from_clips(video(np.clip(taken, 0, 255).astype(np.uint8)), "mine")
    order = np.lexsort((found.position[:, 0], found.position[:, 1].round(-1)))
    np.testing.assert_allclose(found.position[order], markers, atol=0.5)
    assert found.sensor.layout == ("square" if rows > 1 else "free")


@pytest.mark.parametrize(
    ("picture", "sentence"),
    [
        (Picture(keep=(900, 100, 50)), r"--keep: expected a circle in the picture of 320 x 240 px"),
        (Picture(hide=((100, -60, 50),)), r"--hide: .*, found \[100, -60, 50\]; give x,y,radius"),
        (
            Picture(keep=(64, 64, 30)),
            r"6 bright or dark blobs .*where keep and hide leave the picture, found 4; let these",
        ),
    ],
)
def test_masks_that_leave_nothing_are_refused(picture, sentence, draw, video, grid):
    with pytest.raises(InputError, match=sentence):
        calibrate_from_clips(video([draw(grid)] * 9), "mine", picture=picture)


def test_masks_stand_in_the_sensor_file(draw, video, rings, tmp_path):
    picture = Picture(keep=(160, 120, 100.5), hide=((76, 120, 9), (10, 10, 3)), turn=90)
    found = calibrate_from_clips(video([draw(rings)] * 9), "mine", picture=picture)
    assert written(found, tmp_path) == found.sensor
    assert found.sensor.picture == picture
    assert "[picture]\nkeep = [160.0, 120.0, 100.5]\n" in (tmp_path / "mine.toml").read_text()


@pytest.mark.parametrize(
    ("picture", "sentences"),
    [
        (Picture(keep=(160, 120, 60)), ["--keep 160,120,60 cuts through 12 dots: move its edge"]),
        (Picture(hide=((160, 114, 3),)), ["--hide 160,114,3 cuts through 1 dot: move its edge"]),
        (Picture(keep=(160, 120, 70), hide=((160, 120, 5),)), []),
    ],
)
def test_circles_that_cut_through_dots_are_said(picture, sentences, draw, video, rings):
    found = calibrate_from_clips(video([draw(rings)] * 9), "mine", picture=picture)
    said = [line.partition(", so")[0] for line in describe(found) if "cuts through" in line]
    assert said == sentences


def test_fields_of_dots_apart_from_one_another_are_said(draw, video, grid):
    def said(dots):
        found = calibrate_from_clips(video([draw(dots)] * 9), "mine")
        return [line for line in describe(found) if "fields" in line]

    mirrors = grid[grid[:, 0] != 50 + 4 * 28]
    (sentence,) = said(mirrors)
    assert sentence.startswith("The picture shows 2 fields of dots apart from one another, of 24 ")
    assert said(np.concatenate([grid, [[4, 4], [4, 30], [30, 4]]])) == []

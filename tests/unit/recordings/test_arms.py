"""Folders of fingertips on arms: what is read of them, and what is wrong with them."""

import re
import shutil

import cv2
import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.recordings.data_sets import data_set_of

from .arms import write_images, write_lines, write_runs, write_streams


@pytest.fixture
def streams(tmp_path):
    return write_streams(tmp_path / "train")


@pytest.fixture
def runs(tmp_path):
    return write_runs(tmp_path / "runs")


def test_streams_are_recordings_that_count_from_the_image_at_rest(streams):
    session = afferents.read_session(streams)
    felt, silk = session.recordings
    assert (felt.name, felt.texture, felt.speed_mm_s, felt.rest_frame) == ("1", "felt", None, 0)
    assert silk.conditions == {"pose_z": 1.5, "shear_x": 3.0}
    assert felt.video.fps_hz == pytest.approx(100)
    assert (session.declared.rest, session.reference.path.name) == ("reference", "0.png")
    assert [frame.image[0, 0] for frame in session.reference.frames()] == [0]
    assert session.left_out() == [
        "Of 3 samples 1 are stills without a stream (3.png): they have no RA-I, and are left out."
    ]


def test_runs_are_recordings_with_pose_and_force_beside(runs):
    session = afferents.read_session(runs)
    first, second = session.recordings
    assert (first.name, first.texture, first.speed_mm_s) == ("run_2", "cloth_0", 40)
    assert second.steady_s == pytest.approx((0.01, 0.04))
    assert [log.name for log in first.beside] == ["pose", "force"]
    assert (session.press.name, session.declared.press.texture) == ("run_0", "press")
    time_s, values = second.beside[1].read()
    assert time_s[0] == 100
    assert values.shape == (9, 3)
    assert session.left_out() == []


def test_the_poses_say_the_speed_where_targets_do_not(runs):
    targets = runs / "targets.csv"
    targets.write_text(re.sub(r",[^,]*$", "", targets.read_text(), flags=re.M))
    assert [r.speed_mm_s for r in afferents.read_session(runs).recordings] == [40, 20]


def test_what_run_0_does_not_have_is_not_kept(runs):
    (runs / "run_0/robot_data.csv").unlink()
    session = afferents.read_session(runs)
    assert [log.name for r in session.recordings for log in r.beside] == ["force", "force"]
    assert "Pose or force of 2 of 2 runs is not kept (run_1, run_2)" in session.left_out()[0]


def test_pictures_in_a_zip_file_are_read(runs):
    folder = runs / "run_1/time_series_images"
    shutil.make_archive(str(folder), "zip", folder.parent, folder.name)
    shutil.rmtree(folder)
    run = data_set_of(runs).read("run_1")
    assert [frame.image[0, 0] for frame in run.video.frames()] == [0, 10, 20, 30, 40, 50]


def cut(path, text=""):
    """Write the text, or leave out the last row."""
    path.write_text(text or "".join(path.read_text().splitlines(keepends=True)[:-1]))


TORN = {
    "both layouts": (
        lambda root: write_runs(root, 2),
        r"train: expected streams .* or runs .*, found both \(tactile_images/ and run_0, run_1\)",
    ),
    "an image that is not there": (
        lambda root: (root / "tactile_images/3.png").unlink(),
        r"targets\.csv: expected images that are there, found 3\.png",
    ),
    "no rest": (
        lambda root: cut(root / "targets.csv", "tactile_images,class\n1.png,felt\n"),
        r"targets\.csv: expected one row of the class 'reference', .* found 0",
    ),
    "no classes": (
        lambda root: cut(root / "targets.csv", "tactile_images,label\n1.png,felt\n"),
        r"targets\.csv, line 2: expected a cell in the column 'class', found tactile_images, label",
    ),
    "no stream": (
        lambda root: (
            [shutil.rmtree(root / "tactile_images" / n) for n in "12"]
            and write_images(root / "tactile_images", "{}.png", 4)
        ),
        r"found stills alone \(1\.png, 2\.png, 3\.png\), which have no RA-I; record streams",
    ),
}

SPOILT = {
    "a picture lost": (
        lambda root: (root / "tactile_images/1/0003.png").unlink(),
        r"timestamps\.csv: expected rows for the 5 images and no others, found 6 rows, one of them"
        r" for number 3, which is not there; copy",
    ),
    "a picture of another size": (
        lambda root: cv2.imwrite(
            str(root / "tactile_images/1/0003.png"), np.zeros((4, 8), np.uint8)
        ),
        r"0003\.png: expected an image of 6x4 px in 8 bits, found 8x4 px in 8 bits; move",
    ),
    "a picture that can't be read": (
        lambda root: (root / "tactile_images/1/0003.png").write_bytes(b"no image"),
        r"0003\.png: expected a readable image .*, found none in it; write it",
    ),
    "times that go back": (
        lambda root: cut(
            root / "tactile_images/1/timestamps.csv",
            "image,real_time\n" + "".join(f"{n:04}.png,{9 - n}\n" for n in range(6)),
        ),
        r"timestamps\.csv: expected times that rise .* found 8\.0+ s for 0001\.png after 9\.0",
    ),
}


@pytest.mark.parametrize("what", SPOILT)
def test_what_is_wrong_with_pictures_is_one_sentence(streams, what):
    spoil, sentence = SPOILT[what]
    spoil(streams)
    with pytest.raises(InputError, match=sentence):
        list(data_set_of(streams).read("1").video.frames())


@pytest.mark.parametrize("what", TORN)
def test_what_is_wrong_with_streams_is_one_sentence(streams, fails, tmp_path, what):
    tear, sentence = TORN[what]
    tear(streams)
    assert re.search(sentence, fails("extract", streams, tmp_path / "out.zarr", "--workers", "1"))
    assert not (tmp_path / "out.zarr").exists()


def test_the_folder_of_both_parts_is_refused(streams):
    write_streams(streams.parent / "val")
    with pytest.raises(
        InputError, match=r"one part, .* found \S*train and \S*val; give such a part"
    ):
        afferents.read_session(streams.parent)


FORCE = "timestamp,force_x,force_y,force_z\n"
BROKEN = {
    "a run without pictures": (
        lambda root: shutil.rmtree(root / "run_1/time_series_images"),
        r"run_1/time_series_images\.zip: expected a folder or zip of images, found none",
    ),
    "a run without times": (
        lambda root: (root / "run_1/image_data.csv").unlink(),
        r"run_1/image_data\.csv: expected a CSV, found none; copy the run again",
    ),
    "a run without a row": (
        lambda root: write_runs(root, 5) and cut(root / "targets.csv", "class\na\nb\n"),
        r"targets\.csv: expected a row for each of 4 runs, found 2; name the run in each",
    ),
    "a row without a run": (
        lambda root: cut(root / "targets.csv", "sample,class\nrun_1,a\nrun_3,b\n"),
        r"targets\.csv: expected a row for each run .* found run_2 without the other",
    ),
    "only a press": (
        lambda root: (
            [shutil.rmtree(root / run) for run in ("run_1", "run_2")]
            and cut(root / "targets.csv", "class\nfelt\n")
        ),
        r"runs: expected run_1 and others next to the press, found none",
    ),
    "other events": (
        lambda root: cut(root / "run_1/control_data.csv", "timestamp,event\n100,begin\n"),
        r"control_data\.csv: expected .* events 'start' and 'end', .* found timestamp, event with",
    ),
    "events of another clock": (
        lambda root: cut(root / "run_1/control_data.csv", "timestamp,event\n1,start\n2,end\n"),
        r"control_data\.csv: expected events within the 0\.06 s of the images, by their clock",
    ),
    "poses of other columns": (
        lambda root: cut(root / "run_0/robot_data.csv", "timestamp,x\n1,2\n2,3\n"),
        r"run_0/robot_data\.csv: expected the column 'actual_TCP_pose_0', found timestamp, x",
    ),
    "doubled times of the force": (
        lambda root: (
            (root / "run_0/robot_data.csv").unlink()
            or cut(root / "run_0/ft_sensor_data.csv", FORCE + 2 * "1,2,3,4\n")
        ),
        r"run_0/ft_sensor_data\.csv: expected rows of times that rise .* found another in row 3",
    ),
    "a press that nothing follows": (
        lambda root: None,
        r"run_0/robot_data\.csv: expected one whose z explains 90% of what the skin feels",
    ),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_wrong_with_runs_is_one_sentence(runs, fails, tmp_path, what, monkeypatch):
    monkeypatch.setattr("afferents.extraction.clocks.track_markers", a_press)
    tear, sentence = BROKEN[what]
    tear(runs)
    assert re.search(sentence, fails("extract", runs, tmp_path / "out.zarr", "--workers", "1"))
    assert not (tmp_path / "out.zarr").exists()


def a_press(video, _):
    """Stand for tracks of one marker that is pushed aside and comes back."""
    import xarray as xr

    place = np.stack([np.sin(np.linspace(0, 3, video.n_frames)), np.zeros(video.n_frames)], axis=1)
    return xr.Dataset(
        {
            "position": (("time", "marker", "space"), place[:, None]),
            "rest_position": (("marker", "space"), np.zeros((1, 2))),
        },
        coords={"time": video.clock_s - video.clock_s[0]},
    )


def test_a_session_file_may_say_the_same(runs):
    folder = runs / "run_1"
    write_lines(
        folder / "session.toml",
        '[[recordings]]\nvideo = "time_series_images"\ntimes = "image_data.csv"',
        'texture = "felt"',
        '[[recordings.beside]]\nname = "force"\nfile = "ft_sensor_data.csv"\ntime = "timestamp"',
        'columns = ["force_z"]\nunits = "N"',
    )
    (run,) = afferents.read_session(folder).recordings
    force = run.beside[0].variable(run.video.began_s)
    assert force.dims == ("force_time", "force_axis")
    assert force.force_time.values == pytest.approx(np.arange(9) / 100)
    assert force.values[:, 0].tolist() == list(range(9))
    text = (folder / "session.toml").read_text()
    (folder / "session.toml").write_text(text.replace('"force"', '"sa1"'))
    with pytest.raises(InputError, match="a name of letters that no response has"):
        afferents.read_session(folder)


def test_a_session_file_goes_before_and_none_is_drafted(runs, fails):
    sentence = fails("init", runs)
    assert re.search(r"found runs of a fingertip on an arm, which 'afferents extract", sentence)
    assert not (runs / "session.toml").exists()
    text = '[[recordings]]\nvideo = "run_1/time_series_images"\ntexture = "felt"\nfps_hz = 100'
    write_lines(runs / "session.toml", text)
    assert [r.name for r in afferents.read_session(runs).recordings] == ["felt"]

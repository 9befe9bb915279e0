"""From clips as labs have them to a store: sensors, ids, unknown speeds, failures."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents import markers
from afferents.errors import InputError
from afferents.inspection.inspect import grid_sentence
from afferents.store.trimming import cut_frames

ALONE = ("--quiet", "--workers", 1)
TIP_B = (Path(markers.__file__).parent / "sensors/tip_b.toml").read_text()
FRAMES = np.concatenate([np.zeros(11), 4 * np.sin(np.arange(30))])


@pytest.fixture(scope="module")
def clips(tmp_path_factory, make_video):
    """Two clips of the 19 x 19 sensor in two containers, without speeds and sound."""
    root = tmp_path_factory.mktemp("clips")
    make_video(root / "felt_1.mkv", FRAMES)
    make_video(root / "felt_2.mkv", 2 * FRAMES)
    return root


@pytest.fixture
def other_sensor(tmp_path):
    """A sensor with more markers than the clips show."""
    path = tmp_path / "large.toml"
    path.write_text(
        TIP_B.replace("rows = 19", "rows = 25")
        .replace("columns = 19", "columns = 25")
        .replace("n_markers = 361", "n_markers = 625")
    )
    return path


@pytest.fixture
def lab(clips, tmp_path):
    """A copy of the clips beside a session.toml."""

    def write(toml):
        root = tmp_path / "lab"
        if not root.exists():
            shutil.copytree(clips, root)
        (root / "session.toml").write_text(toml)
        return root

    return write


PATTERN = 'pattern = "{texture}_{trial}.mkv"\nsteady_s = [0.15, 0.4]\n'


def attributes(store, name):
    return json.loads((store / name / "zarr.json").read_text())["attributes"]


def test_clips_without_speeds_come_to_a_store(lab, run, tmp_path):
    root, store = lab(PATTERN + "rest_frame = 2\n"), tmp_path / "s.zarr"
    assert run("extract", root, store, *ALONE)[0] == 0
    first, second = afferents.open_responses(store)
    assert [r.attrs["name"] for r in (first, second)] == ["felt/1", "felt/2"]
    assert np.isnan(first.attrs["speed_mm_s"])
    assert attributes(store, "felt/1")["speed_mm_s"] is None  # JSON has no NaN
    assert json.loads(first.attrs["conditions"]) == {"trial": "1"}
    assert first.attrs["steady_s"] == "[0.15, 0.4]"
    assert first.attrs["rest_frame"] == 2
    assert float(second.sa1.max()) == pytest.approx(8, abs=0.5)
    # Nothing is extracted again, but for what the session file now says otherwise.
    before = [(store / f"felt/{n}/zarr.json").stat().st_mtime_ns for n in (1, 2)]
    assert run("extract", root, store, *ALONE)[0] == 0
    lab(
        "steady_s = [0.15, 0.4]\nrest_frame = 2\n"
        '[[recordings]]\nvideo = "felt_1.mkv"\ntexture = "felt"\nid = "felt/1"\n'
        "conditions = { trial = '1' }\n"
        '[[recordings]]\nvideo = "felt_2.mkv"\ntexture = "wool"\nid = "felt/2"\nspeed_mm_s = 20\n'
    )
    assert run("extract", root, store, *ALONE)[0] == 0
    assert (store / "felt/1/zarr.json").stat().st_mtime_ns == before[0]
    assert attributes(store, "felt/2")["texture"] == "wool"
    assert attributes(store, "felt/2")["speed_mm_s"] == 20


def tracks_written(store):
    """Return when the values of each recording's tracks were written: others once it is tracked."""
    return {
        name: [
            (chunk.stat().st_ino, chunk.stat().st_mtime_ns)
            for chunk in sorted((store / name).rglob("c/**/*"))
            if chunk.is_file()
        ]
        for name in ("felt/1", "felt/2")
    }


def test_another_label_tracks_nothing_again(lab, run, tmp_path):
    """The texture's name, speed and conditions are put right where they stand."""
    one = (
        '[[recordings]]\nvideo = "felt_{0}.mkv"\ntexture = "{1}"\nid = "felt/{0}"\n'
        "conditions = {{ trial = '{2}' }}\n{3}"
    )
    store = tmp_path / "s.zarr"
    root = lab(one.format(1, "felt", 1, "") + one.format(2, "felt", 2, ""))
    assert run("extract", root, store, *ALONE)[0] == 0
    before = tracks_written(store)

    def n_tracked():
        now = tracks_written(store)
        return sum(now[name] != before[name] for name in before)

    lab(one.format(1, "wool", 1, "speed_mm_s = 20\n") + one.format(2, "felt", 7, ""))
    assert run("extract", root, store, *ALONE)[0] == 0
    assert n_tracked() == 0
    felt, wool = afferents.open_responses(store)  # their digests hold
    assert (wool.attrs["name"], wool.attrs["texture"], wool.attrs["speed_mm_s"]) == (
        "felt/1",
        "wool",
        20.0,
    )
    assert (felt.attrs["texture"], json.loads(felt.attrs["conditions"])["trial"]) == ("felt", "7")
    assert np.isnan(felt.attrs["speed_mm_s"])
    stamp = (store / "felt/1/zarr.json").stat().st_mtime_ns
    assert run("extract", root, store, *ALONE)[0] == 0
    assert (store / "felt/1/zarr.json").stat().st_mtime_ns == stamp  # nothing to do
    # What the responses rest on is another matter.
    lab(one.format(1, "wool", 1, "rest_frame = 3\n") + one.format(2, "felt", 7, ""))
    assert run("extract", root, store, *ALONE)[0] == 0
    assert n_tracked() == 1


def test_an_accepted_fault_stays_with_another_label(tmp_path, make_video, run):
    root, store = tmp_path / "lab", tmp_path / "s.zarr"
    root.mkdir()
    make_video(root / "a.mkv", np.zeros(211))
    one = '[[recordings]]\nvideo = "a.mkv"\ntexture = "{}"\nid = "a"\n'
    (root / "session.toml").write_text(one.format("felt"))
    assert run("extract", root, store, "--accept", "frozen", *ALONE)[0] == 0
    was = json.loads(afferents.open_responses(store)[0].attrs["conditions"])
    (root / "session.toml").write_text(one.format("wool"))
    assert run("extract", root, store, "--accept", "frozen", *ALONE)[0] == 0
    (found,) = afferents.open_responses(store)
    assert found.attrs["texture"] == "wool"
    assert json.loads(found.attrs["conditions"]) == was
    assert was["accepted"] == "frozen"


def test_ids_of_any_depth(lab, run, tmp_path):
    one = '[[recordings]]\nvideo = "felt_{}.mkv"\ntexture = "felt"\nid = "{}"\n'
    store = tmp_path / "s.zarr"
    root = lab(one.format(1, "alone") + one.format(2, "a/b/c/d"))
    assert run("extract", root, store, *ALONE)[0] == 0
    names = {r.attrs["name"] for r in afferents.open_responses(store)}
    assert names == {"alone", "a/b/c/d"}


def test_a_failed_extraction_does_not_block_the_next(lab, fails, run, other_sensor, tmp_path):
    root, store = lab(PATTERN), tmp_path / "s.zarr"
    sentence = fails("extract", root, store, "--sensor", other_sensor, *ALONE)
    assert "felt_1.mkv: expected " in sentence
    code, *_ = run("extract", root, store, "--sensor", other_sensor, "--keep-going", *ALONE)
    assert code == 3
    assert run("extract", root, store, "--sensor", "tip_b", *ALONE)[0] == 0
    assert len(afferents.open_responses(store)) == 2
    assert "found responses of another" in fails(
        "extract", root, store, "--sensor", other_sensor, *ALONE
    )


def listed(first="", second=""):
    one = '[[recordings]]\nvideo = "felt_{}.mkv"\ntexture = "felt"\nrepetition = {}\n{}'
    return one.format(1, 1, first) + one.format(2, 2, second)


def test_two_sensors_in_one_session(lab, run, fails, other_sensor, tmp_path):
    """Each recording may have its own; one that is not the clip's is named, the others stay."""
    store = tmp_path / "s.zarr"
    root = lab(listed(second=f'sensor = "{other_sensor}"\n'))
    sentence = fails("extract", root, store, "--keep-going", *ALONE, code=3)
    assert "felt_2.mkv: expected " in sentence
    assert "felt/1 " not in sentence
    made = (store / "felt/1/zarr.json").stat().st_mtime_ns
    (root / "other.toml").write_text(TIP_B.replace('name = "', 'name = "other '))
    lab(listed(second='sensor = "other.toml"\n'))
    assert run("extract", root, store, *ALONE)[0] == 0
    assert (store / "felt/1/zarr.json").stat().st_mtime_ns == made
    config = json.loads((store / "zarr.json").read_text())["attributes"]["config"]
    assert len(config["sensors"]) == 2
    sentence = fails("extract", root, store, "--sensor", "tip_b", *ALONE)
    assert "--sensor: expected a session whose recordings name no sensor" in sentence
    lab(listed(second='sensor = "absent.toml"\n'))
    assert "absent.toml: expected a sensor file" in fails("extract", root, store, *ALONE)


def test_a_session_names_its_sensor(lab, fails, run, other_sensor, tmp_path):
    root = lab(f'sensor = "{other_sensor}"\n' + PATTERN)
    assert "felt_1.mkv: expected " in fails("extract", root, tmp_path / "s.zarr", *ALONE)
    assert run("extract", root, tmp_path / "s.zarr", "--sensor", "tip_b", *ALONE)[0] == 0


def test_a_session_of_a_table_is_extracted_as_one_of_a_file(clips, tmp_path):
    table = pd.DataFrame(
        {"video": ["felt_1.mkv", "felt_2.mkv"], "texture": "felt", "repetition": [1, 2]}
    )
    session = afferents.Session.from_table(table, clips, steady_s=(0.15, 0.4))
    first, _ = afferents.extract(session, tmp_path / "s.zarr", workers=1, quiet=True)
    assert first.attrs["name"] == "felt/1"
    assert json.loads(first.attrs["conditions"])["repetition"] == "1"


def test_a_recording_without_constant_speed_says_where_to_write_it():
    with pytest.raises(InputError, match=r"steady_s = \[START, STOP\] in session\.toml, or --stea"):
        cut_frames(np.arange(0, 3, 0.01), "all", None, "felt/1")


def test_a_session_without_speeds_in_a_sentence(lab):
    session = afferents.read_session(lab(PATTERN))
    assert grid_sentence(session) == "2 recordings of 1 textures (felt) at unknown speed."


def test_times_that_go_back_are_refused_and_can_be_counted_instead(
    lab, make_video, fails, run, tmp_path
):
    one = '[[recordings]]\nvideo = "back.avi"\ntexture = "felt"\nsteady_s = [0.15, 0.4]\n'
    root, store = lab(one), tmp_path / "s.zarr"
    make_video(root / "back.avi", FRAMES)  # H.264 in avi, which has no times
    sentence = fails("extract", root, store, *ALONE)
    assert "back.avi: expected frame times of which each is after the one before" in sentence
    lab(one + "fps_hz = 90\n")
    assert run("extract", root, store, *ALONE)[0] == 0
    (found,) = afferents.open_responses(store)
    assert np.allclose(found.time, np.arange(len(FRAMES)) / 90)

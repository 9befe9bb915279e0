"""From clips as labs have them to a store: sensors, ids, unknown speeds, failures."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents import markers
from afferents.extraction.options import describe_declaration
from afferents.inspection.init import grid_sentence
from afferents.markers.session_sensors import find_sensors

ALONE = ("--quiet", "--workers", 1)
TIP_B = (Path(markers.__file__).parent / "sensors/tip_b.toml").read_text()
FRAMES = np.concatenate([np.zeros(11), 4 * np.sin(np.arange(30))])
PATTERN = 'pattern = "{texture}_{trial}.mkv"\nsteady_s = [0.15, 0.4]\n'


@pytest.fixture(scope="module")
def clips(tmp_path_factory, make_video):
    """Two clips of the 19 x 19 sensor, without speeds and sound."""
    root = tmp_path_factory.mktemp("clips")
    make_video(root / "felt_1.mkv", FRAMES)
    make_video(root / "felt_2.mkv", 2 * FRAMES)
    return root


@pytest.fixture
def other_sensor(tmp_path):
    """A sensor with more markers than the clips show."""
    path = tmp_path / "large.toml"
    larger = {"rows = 19": "rows = 25", "columns = 19": "columns = 25", "= 361": "= 625"}
    text = TIP_B
    for old, new in larger.items():
        text = text.replace(old, new)
    path.write_text(text)
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


@pytest.fixture
def extracted(lab, does, tmp_path):
    """Extract what a session.toml says; return the store."""

    def extract(toml):
        does("extract", lab(toml), tmp_path / "s.zarr", *ALONE)
        return tmp_path / "s.zarr"

    return extract


def recording(number, texture="felt", more=""):
    return (
        f'[[recordings]]\nvideo = "felt_{number}.mkv"\ntexture = "{texture}"\n'
        f'id = "felt/{number}"\n{more}'
    )


def written(store, name):
    """Return when each chunk of values was written, and when the description of them was."""
    files = [path for path in sorted((store / name).rglob("*")) if path.is_file()]
    stamps = {path: path.stat().st_mtime_ns for path in files}
    return {p: t for p, t in stamps.items() if p.name != "zarr.json"}, stamps


def test_clips_without_speeds_come_to_a_store(extracted, lab, run, tmp_path):
    store = extracted(PATTERN + "rest_frame = 2\n")
    first, second = afferents.open_responses(store)
    assert [r.attrs["name"] for r in (first, second)] == ["felt/1", "felt/2"]
    assert np.isnan(first.attrs["speed_mm_s"])
    attributes = json.loads((store / "felt/1/zarr.json").read_text())["attributes"]
    assert attributes["speed_mm_s"] is None  # JSON has no NaN
    assert json.loads(first.attrs["conditions"]) == {"trial": "1"}
    assert first.attrs["steady_s"] == "[0.15, 0.4]"
    assert first.attrs["rest_frame"] == 2
    assert float(second.sa1.max()) == pytest.approx(8, abs=0.5)
    session = afferents.read_session(lab(PATTERN))
    assert grid_sentence(session) == "2 recordings of 1 textures (felt) at unknown speed."
    said = run("extract", lab(PATTERN + "rest_frame = 2\n"), tmp_path / "s.zarr", *ALONE)[2]
    assert "2 of 2 recordings say no speed (felt/1, felt/2): to hold out speeds, write" in said


def test_what_is_declared_otherwise_is_extracted_again_alone(extracted):
    store = extracted(recording(1) + recording(2))
    values, stamps = written(store, "felt")
    extracted(recording(1) + recording(2))
    assert written(store, "felt")[1] == stamps  # nothing to do
    extracted(recording(1, "wool", "speed_mm_s = 20\n") + recording(2))
    felt, wool = afferents.open_responses(store)
    label = (wool.attrs["name"], wool.attrs["texture"], wool.attrs["speed_mm_s"])
    assert label == ("felt/1", "wool", 20.0)
    assert felt.attrs["name"] == "felt/2"
    assert written(store, "felt/2")[0].items() <= values.items()


def test_the_rate_of_images_is_among_what_is_declared_of_them(tmp_path):
    (tmp_path / "felt").mkdir()
    said = set()
    for fps_hz in (30, 90):
        (tmp_path / "session.toml").write_text(f'pattern = "{{texture}}/"\nfps_hz = {fps_hz}\n')
        session = afferents.read_session(tmp_path)
        said.add(describe_declaration(session.recordings[0], session, find_sensors(session, None)))
    assert len(said) == 2


def test_a_sensor_that_is_not_there_is_named_with_the_file_that_names_it(fails, lab, tmp_path):
    sentence = fails("extract", lab('sensor = "mine"\n' + PATTERN), tmp_path / "s.zarr", *ALONE)
    assert "session.toml, sensor mine: expected a sensor file" in sentence
    assert sentence.endswith("found none; mend it there, or give --sensor")


def test_ids_of_any_depth(extracted):
    one = '[[recordings]]\nvideo = "felt_{}.mkv"\ntexture = "felt"\nid = "{}"\n'
    store = extracted(one.format(1, "alone") + one.format(2, "a/b/c/d"))
    names = {r.attrs["name"] for r in afferents.open_responses(store)}
    assert names == {"alone", "a/b/c/d"}


def test_a_failed_extraction_does_not_block_the_next(lab, fails, run, does, other_sensor, tmp_path):
    """What a session says of its sensor is overruled by the command."""
    command = ("extract", lab(f'sensor = "{other_sensor}"\n' + PATTERN), tmp_path / "s.zarr")
    assert "felt_1.mkv: expected " in fails(*command, *ALONE)
    assert not (tmp_path / "s.zarr").exists()
    assert run(*command, "--keep-going", *ALONE)[0] == 3
    assert not (tmp_path / "s.zarr").exists()
    does(*command, "--sensor", "tip_b", *ALONE)
    assert len(afferents.open_responses(tmp_path / "s.zarr")) == 2
    another = fails(*command, "--sensor", other_sensor, *ALONE)
    assert (
        "requested sensor, 'tip_b', found those of 'tip_b' (another columns); choose another"
        in another
    )


@pytest.mark.parametrize("command", ["extract", "track"])
def test_where_nothing_names_a_sensor_the_default_is_said(command, lab, run, fails, tmp_path):
    root, said = lab(PATTERN), "No sensor is named, so the markers are taken to be those of the"
    code, _, err = run(command, root, tmp_path / "s.zarr", *ALONE)
    assert (code, err.count(said), err.count("'tip_b'"), err.count("calibrate")) == (0, 1, 1, 1)
    mine = tmp_path / "mine.toml"
    mine.write_text(TIP_B.replace('name = "tip_b"', 'name = "mine"'))
    sentence = fails(command, root, tmp_path / "s.zarr", "--sensor", mine, *ALONE)
    assert "of the requested sensor, 'mine', found those of 'tip_b'; choose another" in sentence
    _, _, err = run(command, root, tmp_path / "t.zarr", "--sensor", mine, *ALONE)
    assert said not in err


def test_two_sensors_in_one_session(lab, does, fails, other_sensor, tmp_path):
    """Each recording may have its own; one that is not the clip's is named, the others stay."""
    store = tmp_path / "s.zarr"
    root = lab(recording(1) + recording(2, more=f'sensor = "{other_sensor}"\n'))
    sentence = fails("extract", root, store, "--keep-going", *ALONE, code=3)
    assert "felt_2.mkv: expected " in sentence
    assert "felt/1 " not in sentence
    made = written(store, "felt/1")
    (root / "other.toml").write_text(TIP_B.replace('name = "', 'name = "other '))
    lab(recording(1) + recording(2, more='sensor = "other.toml"\n'))
    does("extract", root, store, *ALONE)
    assert written(store, "felt/1") == made
    config = json.loads((store / "zarr.json").read_text())["attributes"]["config"]
    assert len(config["sensors"]) == 2
    sentence = fails("extract", root, store, "--sensor", "tip_b", *ALONE)
    assert "--sensor: expected a session whose recordings name no sensor" in sentence
    lab(recording(1) + recording(2, more='sensor = "absent.toml"\n'))
    assert "absent.toml: expected a sensor file" in fails("extract", root, store, *ALONE)


def test_a_session_of_a_table_is_extracted_as_one_of_a_file(clips, tmp_path):
    table = pd.DataFrame(
        {"video": ["felt_1.mkv", "felt_2.mkv"], "texture": "felt", "repetition": [1, 2]}
    )
    session = afferents.Session.from_table(table, clips, steady_s=(0.15, 0.4))
    first, _ = afferents.extract(session, tmp_path / "s.zarr", workers=1, quiet=True)
    assert first.attrs["name"] == "felt/1"
    assert json.loads(first.attrs["conditions"])["repetition"] == "1"


def test_times_that_go_back_are_refused_and_can_be_counted_instead(
    lab, make_video, fails, does, tmp_path
):
    one = '[[recordings]]\nvideo = "back.avi"\ntexture = "felt"\nsteady_s = [0.15, 0.4]\n'
    root, store = lab(one), tmp_path / "s.zarr"
    make_video(root / "back.avi", FRAMES)  # H.264 in avi, which has no times
    sentence = fails("extract", root, store, *ALONE)
    assert "back.avi: expected frame times of which each is after the one before" in sentence
    track = ("track", root / "back.avi", tmp_path / "t.zarr", "--sensor", "tip_b", "--quiet")
    assert "back.avi: expected frame times of which each is after the one before" in fails(*track)
    lab(one + "fps_hz = 90\n")
    does("extract", root, store, *ALONE)
    (found,) = afferents.open_responses(store)
    assert np.allclose(found.time, np.arange(len(FRAMES)) / 90)

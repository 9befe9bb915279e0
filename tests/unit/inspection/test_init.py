"""The first session.toml or dataset.toml that `afferents init` writes, and what it reads as."""

import os
import tomllib

import cv2
import numpy as np
import pandas as pd
import pytest
import soundfile

import afferents
from afferents.errors import InputError
from afferents.recordings.data_sets import data_set_of
from afferents.recordings.media import left_out

from ..films import write_film

EVEN_S = np.arange(700) / 100


@pytest.fixture
def folder(tmp_path, make_video):
    """Write videos of these names, each of a tenth of a second."""

    def write(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            make_video(tmp_path / name, np.zeros(10), preset="ultrafast")
        return tmp_path

    return write


@pytest.fixture
def tables(tmp_path):
    """Write tables of these names, each of times and a taxel."""

    def write(names, time_s, columns=("time_ms", "taxel"), unit=1000, **how):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            table = pd.DataFrame(np.c_[unit * time_s, np.sin(time_s)], columns=columns)
            table.to_csv(tmp_path / name, index=False, **how)
        return tmp_path

    return write


def said(made):
    return "\n".join(made.sentences)


def test_names_without_a_rule_are_listed_and_short_clips_said(folder):
    root = folder("concrete.avi", "soft felt.mkv", "silk 30 mm_s.avi")
    made = afferents.init_session(root)
    assert [(r.name, r.speed_mm_s) for r in afferents.read_session(root).recordings] == [
        ("concrete", None),
        ("silk 30 mm_s/30", 30.0),
        ("soft felt", None),
    ]
    assert "3 of 3 videos last 5 s or less" in said(made)
    assert "fill in steady_s" in said(made)
    assert "No sensor file lies here" in said(made)


def test_sound_sensors_and_what_cannot_be_read(folder):
    root = folder("felt.avi", "silk.avi")
    for name in ("felt", "silk", "slow"):
        soundfile.write(root / f"{name}.wav", np.zeros(800), 8000)
        sensor = 'name = "s"\nlayout = "free"\n[detector]\nradius_px = 3\nblob_colour = 255\n'
        (root / f"{name}.toml").write_text(sensor)
    (root / "broken.avi").write_bytes(b"nothing")
    write_film(root / "slow.avi", [np.zeros((48, 64), np.uint8)] * 10, rate=30)
    made = afferents.init_session(root)
    assert "Can't be read, and left out: broken.avi." in said(made)
    assert "Frame rates contradict each other: 30 in slow.avi, 90 in felt.avi" in said(made)
    felt, silk, _ = afferents.read_session(root).recordings
    assert felt.audio.path.name == "felt.wav"
    assert silk.sensor == str(root / "silk.toml")


@pytest.mark.parametrize(
    ("names", "pattern", "stray"),
    [
        (["felt_20", "felt_40"], "{texture}_{speed}.avi", ()),
        (
            [f"{texture}_{mm_s}mms" for texture in ("felt", "silk") for mm_s in (20, 40)],
            "{texture}_{speed}mms.avi",
            ("at rest",),
        ),
        (
            [f"{t}-{n}N-{v}mmps" for t in ("felt", "silk") for n in (1, 2) for v in (20, 40)],
            "{texture}-{force}N-{speed}mmps.avi",
            (),
        ),
    ],
    ids=["rule", "stray", "parts"],
)
def test_names_of_videos_that_follow_a_rule_and_their_sound(folder, names, pattern, stray):
    root = folder(*(f"{name}.avi" for name in (*names, *stray)))
    for name in names:
        soundfile.write(root / f"{name}.wav", np.zeros(800), 8000)
    made = afferents.init_session(root)
    assert tomllib.loads(made.path.read_text())["pattern"] == pattern
    assert f"Guessed from the names: {pattern}" in said(made)
    for name in stray:
        assert f"left out: {name}.avi; not of the pattern '{pattern}'" in said(made)
    recordings = afferents.read_session(root).recordings
    assert sorted(one.audio.path.stem for one in recordings) == sorted(names)


def test_endings_in_capitals_are_of_the_pattern_and_tables_of_no_rule_are_named(tables):
    names = ["felt_20mmps.csv", "felt_40mmps.CSV", "silk_20mmps.csv", "silk_40mmps.csv"]
    root = tables([*names, "silk-60mmps.csv"], EVEN_S)
    made = afferents.init_session(root)
    assert "1 file is left out: silk-60mmps.csv; not of '{texture}_{speed}mmps.csv'" in said(made)
    data_set = data_set_of(root)
    session = data_set.scan()
    assert sorted(one.source.name for one in session.recordings) == names
    assert data_set.describe(session)[-1].startswith("1 file is left out: silk-60mmps.csv")


def test_names_that_are_no_utf8_are_refused(tmp_path, fails):
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    soundfile.write(os.fsencode(folder / "20.wav"), np.zeros(80), 8000)
    assert "expected a name in UTF-8, found other bytes; rename it" in fails("init", tmp_path)
    for pattern in ("{texture}/{speed}.wav", "*/{texture}.wav"):
        (tmp_path / "session.toml").write_text(f'pattern = "{pattern}"\n')
        with pytest.raises(InputError, match="expected a name in UTF-8"):
            afferents.read_session(tmp_path)


def test_links_to_themselves_are_no_files(tmp_path, fails):
    for name, to in (("gone.wav", "none.wav"), ("self.wav", "self.wav")):
        (tmp_path / name).symlink_to(tmp_path / to)
    soundfile.write(tmp_path / "felt.wav", np.zeros(80), 8000)
    told = left_out(tmp_path, [tmp_path / "felt.wav"], {".wav"}, "not read")
    assert told == ["2 files are left out: gone.wav, self.wav; not read."]
    clips = [str(tmp_path / name) for name in ("self.wav", "gone.wav")]
    assert "found no such file" in fails("calibrate", *clips, "--out", str(tmp_path / "s.toml"))


def test_images_are_asked_for_their_rate(tmp_path):
    (tmp_path / "felt_1").mkdir()
    for n in range(3):
        cv2.imwrite(str(tmp_path / f"felt_1/{n}.png"), np.zeros((4, 6), np.uint8))
    made = afferents.init_session(tmp_path)
    assert 'pattern = "{texture}_{trial}/"' in made.path.read_text()
    assert "To be mended before it is a session" in said(made)
    made.path.write_text(made.path.read_text().replace("# fps_hz = 30", "fps_hz = 30"))
    assert afferents.read_session(tmp_path).recordings[0].fps_hz == 30
    with pytest.raises(InputError, match=r"the images of one; give the folder that holds it, .+"):
        afferents.init_session(tmp_path / "felt_1")


def test_the_published_layout_needs_no_list(small_session, tmp_path):
    (tmp_path / "3").symlink_to(small_session / "3")
    assert "published layout" in said(afferents.init_session(tmp_path))
    assert [r.name for r in afferents.read_session(tmp_path).recordings] == ["3/20", "3/40", "3/60"]


@pytest.mark.parametrize(
    ("names", "pattern"),
    [
        (["felt/20_1.csv", "silk/20_1.csv"], "{texture}/{speed}_{trial}.csv"),
        (["felt/x.csv", "silk/y.csv"], "{texture}/{run1}.csv"),
        (
            [f"T1/Data[Texture({n})][Speed(2400)][Trial(1)].csv" for n in (1, 12)],
            "T{t}/Data[Texture({texture})][Speed({speed})][Trial({trial})].csv",
        ),
        (
            [f"Texture{n}/Texture({n})Force(0.5).csv" for n in (1, 12)],
            "Texture{*}/Texture({texture})Force({force}).csv",
        ),
    ],
)
def test_names_of_tables(tables, names, pattern):
    root = tables(names, EVEN_S)
    made = afferents.init_session(root)
    content = tomllib.loads(made.path.read_text())
    assert made.path.name == "dataset.toml"
    assert content["files"]["pattern"] == pattern
    assert content["signal"] == {"channels": ["taxel"], "time": "time_ms", "time_unit": "ms"}
    session = data_set_of(root).scan()
    assert len(session.textures) == len(names)
    assert session.recordings[0].audio.read().attrs["sample_rate_hz"] == 100


def test_uneven_rows_without_a_header_are_resampled(tables):
    time = np.cumsum(np.random.default_rng(0).choice([0.001, 0.004], 500))
    root = tables(["felt_20.csv", "silk_40.csv"], time, unit=1, header=False, sep=";")
    made = afferents.init_session(root)
    content = tomllib.loads(made.path.read_text())["signal"]
    assert (content["separator"], content["header"], content["time"]) == (";", False, 0)
    assert content["resample_hz"] == pytest.approx(400, rel=0.1)
    assert content["steady_s"] == "all"
    assert "so they are resampled" in said(made)
    assert "2 recordings of 2 textures" in made.sentences[-1]


def test_columns_that_are_no_signals_are_left_out_and_dead_ones_kept(tmp_path):
    for n, name in enumerate(("felt_20mms", "felt_40mms", "silk_20mms")):
        table = {"": range(700), "time": 1000 + 2 * np.arange(700), "x": np.sin(EVEN_S * (n + 1))}
        table |= {"host_time": 5.1 + EVEN_S, "label": n, "frame": "base", "dead": 3.0}
        pd.DataFrame(table).to_csv(tmp_path / f"{name}.csv", index=False)
    (tmp_path / "a broken_30mms.csv").write_text("nothing\n")
    made = afferents.init_session(tmp_path)
    signal = tomllib.loads(made.path.read_text())["signal"]
    assert signal["channels"] == ["x", "dead"]
    assert (signal["time"], signal["time_unit"]) == ("time", "ms")
    assert "Column time holds times in ms, since rows can't be 2e+03 ms apart" in said(made)
    assert "Can't be read, 1 of 4 files" in said(made)
    for name, why in (("0", "rises"), ("host_time", "rises"), ("label", "has one value in each")):
        assert f"{name} (it {why}" in said(made)
    assert "frame (it holds no numbers)" in said(made)
    assert "Kept as channels: dead (it never changes, in any file)." in said(made)


def test_files_that_cannot_be_read_leave_a_description_to_be_mended(tmp_path):
    for name in ("felt_20", "silk_20"):
        (tmp_path / f"{name}.csv").write_text("n,a\n0,0,5\n1,0,25\n")
    made = afferents.init_session(tmp_path)
    assert tomllib.loads(made.path.read_text())["files"]["pattern"] == "{texture}_{speed}.csv"
    assert "To be mended before it can be learnt from" in made.sentences[-1]
    assert "decimal commas need decimal = ',' and another separator" in made.sentences[-1]


def test_rows_out_of_order_and_long_gaps_are_allowed_as_far_as_they_are_there(tables):
    time = np.cumsum(np.random.default_rng(0).choice([0.0, 0.004], 2000, p=[0.1, 0.9]))
    time[1000:] += 0.05
    root = tables(["felt_20.csv", "silk_40.csv"], time)
    made = afferents.init_session(root)
    signal = tomllib.loads(made.path.read_text())["signal"]
    assert (signal["out_of_order"], signal["longest_gap_ms"]) == (0.11, 50)
    assert "2 recordings of 2 textures" in made.sentences[-1]


def test_a_table_without_times_asks_for_its_rate(tmp_path):
    for name in ("felt_20", "silk_20"):
        np.save(tmp_path / f"{name}.npy", np.random.default_rng(0).normal(size=(500, 3)))
    made = afferents.init_session(tmp_path)
    assert "fill in sample_rate_hz, which nothing can confirm" in said(made)
    assert "To be mended before it can be learnt from" in made.sentences[-1]
    made.path.write_text(made.path.read_text().replace("# sample_rate_hz", "sample_rate_hz"))
    assert data_set_of(tmp_path).scan().recordings[0].audio.n_channels == 3


@pytest.mark.parametrize(
    ("name", "line"), [("session.toml", "Session file"), ("dataset.toml", "Description")]
)
def test_what_stands_there_is_kept(folder, tables, does, fails, name, line):
    of_tables = name == "dataset.toml"
    root = tables(["felt_20.csv", "silk_20.csv"], EVEN_S) if of_tables else folder("felt.avi")
    out = does("init", root)
    assert out.splitlines()[-1] == f"{line} to check: {root / name}"
    assert "add --force" in fails("init", root)
    does("init", root, "--force")
    (root / name).write_text("steady_s = [1, 2]\n")
    assert "holds something else" in fails("init", root, "--force")
    (root / name).rename(root / "session.json")
    if not of_tables:
        assert "a folder without session.json, found one" in fails("init", root)


def test_a_folder_of_nothing_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        afferents.init_session(tmp_path / "absent")
    with pytest.raises(InputError, match="videos, sound, or folders of numbered images, found non"):
        afferents.init_session(tmp_path)

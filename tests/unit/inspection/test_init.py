"""The first session file that `afferents init` writes, and what it says of its guesses."""

import tomllib

import cv2
import numpy as np
import pytest
import soundfile

import afferents
from afferents.errors import InputError

TEN = np.zeros(10)


@pytest.fixture
def folder(tmp_path, make_video):
    """Write videos of these names, each of a tenth of a second."""

    def write(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            make_video(tmp_path / name, TEN, preset="ultrafast")
        return tmp_path

    return write


def said(made):
    return "\n".join(made.sentences)


@pytest.mark.parametrize(
    ("names", "pattern", "ids"),
    [
        (["felt/20_1.avi", "silk/20_1.avi"], "{texture}/{speed}_{trial}.avi", "felt/20/1"),
        (["felt_20.mkv", "silk_20.mkv"], "{texture}_{speed}.mkv", "felt/20"),
        (["felt-1.avi", "felt-2.avi"], "{texture}-{trial}.avi", "felt/1"),
        (["felt/40.avi", "silk/40.avi"], "{texture}/{speed}.avi", "felt/40"),
    ],
)
def test_names_that_follow_a_rule(folder, names, pattern, ids):
    root = folder(*names)
    made = afferents.init_session(root)
    assert tomllib.loads(made.path.read_text())["pattern"] == pattern
    assert f"Guessed from the names: {pattern}" in said(made)
    session = afferents.read_session(root)
    assert session.recordings[0].name == ids
    assert len(session.recordings) == 2


def test_names_without_a_rule_are_listed_and_short_clips_said(folder):
    root = folder("concrete.avi", "soft felt.mkv", "silk 30 mm_s.avi")
    made = afferents.init_session(root)
    recordings = afferents.read_session(root).recordings
    assert [(r.name, r.speed_mm_s) for r in recordings] == [
        ("concrete", None),
        ("silk 30 mm_s/30", 30.0),
        ("soft felt", None),
    ]
    assert "3 of 3 videos last 5 s or less" in said(made)
    assert "fill in steady_s" in said(made)
    assert "No sensor file lies here" in said(made)
    assert "3 recordings of 3 textures at 30 mm/s." in said(made)


def test_sound_sensors_and_what_cannot_be_read(folder, tmp_path):
    root = folder("felt.avi", "silk.avi")
    for name in ("felt", "silk"):
        soundfile.write(root / f"{name}.wav", np.zeros(800), 8000)
        sensor = 'name = "s"\nlayout = "free"\n[detector]\nradius_px = 3\nblob_colour = 255\n'
        (root / f"{name}.toml").write_text(sensor)
    (root / "broken.avi").write_bytes(b"nothing")
    made = afferents.init_session(root)
    assert "Can't be read, and left out: broken.avi." in said(made)
    felt, silk = afferents.read_session(root).recordings
    assert felt.audio.path.name == "felt.wav"
    assert silk.sensor == str(root / "silk.toml")


def test_sound_of_a_pattern(folder):
    root = folder("felt_20.avi", "felt_40.avi")
    for speed in (20, 40):
        soundfile.write(root / f"felt_{speed}.wav", np.zeros(800), 8000)
    afferents.init_session(root)
    assert [r.audio.path.name for r in afferents.read_session(root).recordings] == [
        "felt_20.wav",
        "felt_40.wav",
    ]


def test_images_are_asked_for_their_rate(tmp_path):
    for n in range(3):
        (tmp_path / "felt_1").mkdir(exist_ok=True)
        cv2.imwrite(str(tmp_path / f"felt_1/{n}.png"), np.zeros((4, 6), np.uint8))
    made = afferents.init_session(tmp_path)
    assert 'pattern = "{texture}_{trial}/"' in made.path.read_text()
    assert "To be mended before it is a session" in said(made)
    made.path.write_text(made.path.read_text().replace("# fps_hz = 30", "fps_hz = 30"))
    assert afferents.read_session(tmp_path).recordings[0].fps_hz == 30


def test_the_published_layout_needs_no_list(small_session, tmp_path):
    (tmp_path / "3").symlink_to(small_session / "3")
    made = afferents.init_session(tmp_path)
    assert "published layout" in said(made)
    assert [r.name for r in afferents.read_session(tmp_path).recordings] == ["3/20", "3/40", "3/60"]


def test_frame_rates_that_contradict_each_other(folder, tmp_path):
    root = folder("felt.avi")
    writer = cv2.VideoWriter(str(root / "silk.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 30, (64, 48))
    for _ in range(10):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    made = afferents.init_session(root)
    assert "Frame rates contradict each other: 30 in silk.avi, 90 in felt.avi" in said(made)


def test_what_stands_there_is_kept(folder, run, fails, tmp_path):
    root = folder("felt.avi")
    assert "no such folder" in fails("init", root / "absent")
    code, out, _ = run("init", root)
    assert code == 0
    assert out.splitlines()[-1] == f"Session file to check: {root / 'session.toml'}"
    assert "add --force" in fails("init", root)
    assert run("init", root, "--force")[0] == 0
    (root / "session.toml").write_text("steady_s = [1, 2]\n")
    assert "holds something else" in fails("init", root, "--force")
    (root / "session.toml").rename(root / "session.json")
    assert "a folder without session.json, found one" in fails("init", root)
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="videos, sound, or folders of numbered images, found non"):
        afferents.init_session(empty)

"""The published layout: what counts as a condition, and what is refused at the door."""

import json
import shutil
from pathlib import Path

import pytest

from afferents.errors import InputError
from afferents.recordings.check import check_recording, facts
from afferents.recordings.session import read_session
from afferents.recordings.session_file import SessionFile, session_file

TEXTURES = [f"{mm / 2:g}" for mm in range(13)]
SPEEDS = [str(v) for v in range(10, 101, 10)]
GRID = [f"{texture}/{speed}" for texture in TEXTURES for speed in SPEEDS]


def test_published_layout(write_session):
    root = write_session(*GRID)
    (root / "0/10/throw_away.mp4").touch()
    for other in ("processed/vibration/0", "models/static_SA/0", "figures", "static/0", ".cache/1"):
        (root / other).mkdir(parents=True)
    (root / ".cache/1/video.mp4").touch()
    (root / "static/0/video.mp4").touch()
    session = read_session(root)
    assert [r.name for r in session.recordings] == GRID
    assert session.textures == tuple(TEXTURES)
    assert session.speeds_mm_s == tuple(map(float, SPEEDS))
    assert session.reference is not None
    assert session.reference.path == root / "0/10/throw_away.mp4"
    assert session.recordings[0].steady_s is None


def test_textures_may_be_words(write_session):
    session = read_session(write_session("linen/12.5", "2/12.5", "10/12.5"))
    two, ten, linen = session.recordings
    assert [r.texture for r in (two, ten, linen)] == ["2", "10", "linen"]
    assert linen.speed_mm_s == 12.5
    assert session.reference is None


@pytest.mark.parametrize("file", ["video.mp4", "audio.wav"])
def test_a_file_is_in_all_conditions_or_in_none(write_session, file):
    conditions = ("0/10", "0/20", "1/10", "1/20")
    root = write_session(*conditions)
    for condition in conditions[1:3]:
        (root / condition / file).unlink()
    with pytest.raises(InputError, match=rf"{file} in every condition .* none in 0/20, 1/10;"):
        read_session(root)
    for condition in (conditions[0], conditions[3]):
        (root / condition / file).unlink()
    assert len(read_session(root).recordings) == 4


def test_a_hole_is_named(write_session):
    root = write_session("0/10", "0/20", "1/10", "1/20", "2/10", "2/20")
    shutil.rmtree(root / "1/20")
    shutil.rmtree(root / "2/10")
    with pytest.raises(
        InputError, match=r"found none in 1/20, 2/10; .*holes = \[\['1', 20.0\], \['2', 10.0\]\]"
    ):
        read_session(root)


def test_a_declared_hole_is_none(write_session):
    root = write_session("0.5/10", "0.5/20", "linen/10", "linen/20", "1/10")
    (root / "session.json").write_text(json.dumps({"holes": [[1, 20]]}))
    assert len(read_session(root).recordings) == 5
    shutil.rmtree(root / "linen/20")
    with pytest.raises(InputError, match="found none in linen/20;"):
        read_session(root)


@pytest.mark.parametrize("speed", ["fast", "0", "-10", "nan", "1_0", "10mm"])
def test_a_speed_is_a_positive_number(write_session, speed):
    with pytest.raises(InputError, match=f"named by its speed in mm/s, found '{speed}'"):
        read_session(write_session("0/10", f"0/{speed}"))


def test_no_session(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        read_session(tmp_path / "absent")
    with pytest.raises(InputError, match="found none of them"):
        read_session(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="found a file"):
        read_session(tmp_path / "file")


def test_unreadable_folder(write_session, monkeypatch):
    root = write_session("0/10")

    def refuse(folder):
        raise PermissionError(13, "Permission denied", str(folder))

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(InputError, match="expected a readable folder, found Permission denied"):
        read_session(root)


def test_session_file_declares(write_session):
    root = write_session("0/10")
    assert session_file(root) == SessionFile()
    declared = {"steady_s": [1, 3.5], "direction": "-y", "sensor": {"name": "tip-b"}}
    (root / "session.json").write_text(json.dumps(declared))
    recording = read_session(root).recordings[0]
    assert recording.steady_s == (1.0, 3.5)
    assert recording.conditions == {"direction": "-y"}
    assert "sensor" not in session_file(root).model_dump()


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ('{"steady_s": [3, 1]}', "steady_s"),
        ('{"sample_rate_hz": "often"}', "sample_rate_hz"),
        ('{"audio_channels": 1}', "sensor_channel"),
        ('{"holes": [[1]]}', "holes"),
        ('{"direction": "left"}', "direction"),
        ("[1, 2]", "session"),
        ("{", "JSON"),
    ],
)
def test_a_bad_session_file(write_session, text, field):
    root = write_session("0/10")
    (root / "session.json").write_text(text)
    with pytest.raises(InputError, match=rf"session\.json: expected .*{field}"):
        read_session(root)


class TestOneRecording:
    """What `check_recording` refuses; the defaults are 640x480 and stereo at 44.1 kHz."""

    @pytest.fixture
    def make(self, tmp_path, write_video, write_audio):
        def make(size=(640, 480), **audio):
            write_video(
                tmp_path / "3/50/video.mp4", size=size, n_frames=90, options={"preset": "ultrafast"}
            )
            write_audio(tmp_path / "3/50/audio.wav", **{"duration_s": 1.0, **audio})
            return read_session(tmp_path).recordings[0]

        return make

    def test_as_published(self, make):
        recording = make()
        check_recording(recording, SessionFile())
        found = facts(recording)
        assert (found.video.width, found.video.height, found.video.n_frames) == (640, 480, 90)
        assert found.video.duration_s == pytest.approx(1.0)
        assert found.vibration.n_channels == 2
        assert found.vibration.duration_s == pytest.approx(1.0)

    def test_size(self, make):
        recording = make(size=(320, 240))
        with pytest.raises(InputError, match=r"50.video\.mp4: expected .*640x480 px, .*320x240"):
            check_recording(recording, SessionFile())
        check_recording(recording, SessionFile(frame_width=320, frame_height=240))

    def test_frame_rate(self, make):
        recording = make()
        check_recording(recording, SessionFile(fps_hz=82))
        with pytest.raises(InputError, match=r"mp4: expected about 80 frames a second, found 90"):
            check_recording(recording, SessionFile(fps_hz=80))

    def test_rate(self, make):
        recording = make(sample_rate_hz=8000)
        with pytest.raises(InputError, match=r"2 channel\(s\) at 44100 Hz, found 2 at 8000 Hz"):
            check_recording(recording, SessionFile())
        check_recording(recording, SessionFile(sample_rate_hz=8000))

    def test_channels(self, make):
        recording = make(channels=1)
        with pytest.raises(InputError, match="found 1 at 44100 Hz"):
            check_recording(recording, SessionFile())
        check_recording(recording, SessionFile(audio_channels=1, sensor_channel=0))

    def test_short_audio(self, make):
        check_recording(make(duration_s=0.51), SessionFile())
        with pytest.raises(InputError, match=r"a video of 1\.00 s, found 0\.49 s"):
            check_recording(make(duration_s=0.49), SessionFile())

    def test_long_audio(self, make):
        check_recording(make(duration_s=2.0), SessionFile())
        expected = r"audio of at most 2\.05 s, for a video of 1\.00 s, found 2\.10 s; .*length$"
        with pytest.raises(InputError, match=expected):
            check_recording(make(duration_s=2.1), SessionFile())

    def test_another_length_can_be_accepted(self, make):
        for duration_s in (0.3, 3.0):
            (doubt,) = check_recording(make(duration_s=duration_s), SessionFile(), {"length"})
            assert doubt.kind == "length"
        assert check_recording(make(), SessionFile(), {"length"}) == []

    def test_broken_files_do_not_stop_the_grid(self, write_session):
        first, _ = read_session(write_session("0/10", "0/20")).recordings
        with pytest.raises(InputError, match="expected a readable video"):
            check_recording(first, SessionFile())

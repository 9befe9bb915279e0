"""The published layout: what counts as a condition, and what is refused at the door."""

import json
import shutil

import pytest

from afferents.errors import InputError
from afferents.recordings.check import check_recording, facts
from afferents.recordings.data_sets import read_session
from afferents.recordings.session_file import SessionFile, read_session_file

TEXTURES = [f"{mm / 2:g}" for mm in range(13)]
SPEEDS = [str(v) for v in range(10, 101, 10)]
GRID = [f"{texture}/{speed}" for texture in TEXTURES for speed in SPEEDS]


def test_published_layout(write_session):
    root = write_session(*GRID)
    (root / "0/10/throw_away.mp4").touch()
    for other in ("processed/vibration/0", "models/static_SA/0", "figures", ".cache/1"):
        (root / other).mkdir(parents=True)
    (root / ".cache/1/video.mp4").touch()
    session = read_session(root)
    assert [r.name for r in session.recordings] == GRID
    assert session.textures == tuple(TEXTURES)
    assert session.speeds_mm_s == tuple(map(float, SPEEDS))
    assert session.reference is not None
    assert session.reference.path == root / "0/10/throw_away.mp4"
    assert session.recordings[0].steady_s is None


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


def test_a_hole_is_named_unless_it_is_declared(write_session):
    root = write_session("0.5/10", "0.5/20", "1/10", "1/20", "linen/10", "linen/20")
    shutil.rmtree(root / "1/20")
    shutil.rmtree(root / "linen/10")
    said = r"found none in 1/20, linen/10; .*holes = \[\['1', 20.0\], \['linen', 10.0\]\]"
    with pytest.raises(InputError, match=said):
        read_session(root)
    (root / "session.json").write_text(json.dumps({"holes": [[1, 20]]}))
    with pytest.raises(InputError, match="found none in linen/10;"):
        read_session(root)
    (root / "session.json").write_text(json.dumps({"holes": [[1, 20], ["linen", 10]]}))
    assert len(read_session(root).recordings) == 4


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


def test_session_file_declares(write_session):
    root = write_session("0/10")
    assert read_session_file(root) == SessionFile()
    declared = {"steady_s": [1, 3.5], "direction": "-y", "sensor": {"name": "tip-b"}}
    (root / "session.json").write_text(json.dumps(declared))
    recording = read_session(root).recordings[0]
    assert recording.steady_s == (1.0, 3.5)
    assert recording.conditions == {"direction": "-y"}
    assert "sensor" not in read_session_file(root).model_dump()
    (root / "session.json").write_text('{"audio_channels": 1}')
    assert read_session_file(root).channel == 0
    (root / "session.json").write_text('{"audio_channels": 1, "sensor_channel": 1}')
    with pytest.raises(InputError, match=r"session\.json: expected .*sensor_channel"):
        read_session(root)


@pytest.fixture
def make(tmp_path, write_video, write_audio):
    """Make a session of one recording of a second, by default of 640x480 px and 44.1 kHz stereo."""

    def one(size=(640, 480), **audio):
        path = tmp_path / "3/50/video.mp4"
        write_video(path, size=size, n_frames=90, options={"preset": "ultrafast"})
        write_audio(tmp_path / "3/50/audio.wav", **{"duration_s": 1.0, **audio})
        return read_session(tmp_path).recordings[0]

    return one


def test_facts_of_a_recording(make):
    recording = make()
    assert check_recording(recording, SessionFile(), {"length"}) == []
    found = facts(recording)
    assert (found["video"]["width"], found["video"]["height"], found["video"]["n_frames"]) == (
        640,
        480,
        90,
    )
    assert found["video"]["duration_s"] == pytest.approx(1.0)
    assert found["vibration"]["n_channels"] == 2
    assert found["vibration"]["duration_s"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("is_so", "sentence", "declared"),
    [
        (
            {"size": (320, 240)},
            r"50.video\.mp4: expected .*640x480 px, .*320x240",
            {"frame_width": 320, "frame_height": 240},
        ),
        (
            {"sample_rate_hz": 8000},
            r"2 channel\(s\) at 44100 Hz, found 2 at 8000 Hz",
            {"sample_rate_hz": 8000},
        ),
        ({"channels": 1}, "found 1 at 44100 Hz", {"audio_channels": 1, "sensor_channel": 0}),
    ],
)
def test_what_is_not_as_declared_is_refused(make, is_so, sentence, declared):
    recording = make(**is_so)
    with pytest.raises(InputError, match=sentence):
        check_recording(recording, SessionFile())
    check_recording(recording, SessionFile(**declared))


def test_a_frame_rate_may_be_a_tenth_off(make):
    check_recording(make(), SessionFile(fps_hz=82))
    with pytest.raises(InputError, match=r"mp4: expected about 80 frames a second, found 90"):
        check_recording(make(), SessionFile(fps_hz=80))


@pytest.mark.parametrize(
    ("seconds", "sentence"),
    [
        (0.49, r"a video of 1\.00 s, found 0\.49 s"),
        (2.1, r"audio of at most 2\.05 s, for a video of 1\.00 s, found 2\.10 s; .*length$"),
        (0.51, None),
        (2.0, None),
    ],
)
def test_another_length_is_refused_or_accepted(make, seconds, sentence):
    recording = make(duration_s=seconds)
    if sentence is None:
        assert check_recording(recording, SessionFile()) == []
        return
    with pytest.raises(InputError, match=sentence):
        check_recording(recording, SessionFile())
    (doubt,) = check_recording(recording, SessionFile(), {"length"})
    assert doubt.kind == "length"


def test_broken_files_do_not_stop_the_grid(write_session):
    first, _ = read_session(write_session("0/10", "0/20")).recordings
    with pytest.raises(InputError, match="expected a readable video"):
        check_recording(first, SessionFile())

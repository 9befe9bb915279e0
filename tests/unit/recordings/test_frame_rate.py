"""Containers that tell another frame rate than the camera had."""

import json
import re

import numpy as np
import pytest
import soundfile

import afferents
from afferents.errors import InputError
from afferents.quality.issues import KINDS
from afferents.recordings.audio import WavFile
from afferents.recordings.check import check_recording, wrong_rate
from afferents.recordings.data_sets import read_session
from afferents.recordings.session_file import SessionFile

N_FRAMES, TRUE_HZ, TOLD_HZ = 270, 90, 30


@pytest.fixture
def session(tmp_path, write_video):
    """Frames of 3 s at 90 a second that their container takes for 9 s at 30."""
    for speed in (10, 20):
        folder = tmp_path / "s/0" / str(speed)
        write_video(folder / "video.mp4", n_frames=N_FRAMES, rate=TOLD_HZ, size=(64, 48))
        soundfile.write(folder / "audio.wav", np.zeros((3 * 8000, 2)), 8000)
    declare(tmp_path / "s")
    return tmp_path / "s"


def declare(root, **more):
    size = {"frame_width": 64, "frame_height": 48, "sample_rate_hz": 8000}
    (root / "session.json").write_text(json.dumps({**size, **more}))


def checked(session):
    return [check_recording(one, session.declared) for one in session.recordings]


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        (
            {},
            "about 90 frames a second, found 30; its 270 frames are as long as its sound at 90 a "
            "second, so the container's rate is wrong: give --fps 90, or write fps_hz and "
            "fps_overrules (true) into session.json",
        ),
        (
            {"fps_hz": TOLD_HZ},
            "for a video of 9.00 s, found 3.00 s; if the video's 30 frames a second are wrong, "
            "give the true --fps",
        ),
    ],
)
def test_the_error_names_the_cause_and_the_option(session, declared, expected):
    declare(session, **declared)
    with pytest.raises(InputError, match=re.escape(expected)):
        checked(read_session(session))


def test_the_option_overrules_the_container_and_times_follow(session):
    found = read_session(session, fps_hz=TRUE_HZ)
    assert checked(found) == [[], []]
    video = found.recordings[0].video
    assert (video.fps_hz, video.duration_s) == (TRUE_HZ, pytest.approx(3.0))
    times = [frame.time_s for frame in video.frames()]
    np.testing.assert_allclose(times, np.arange(N_FRAMES) / TRUE_HZ)
    assert found.declared == read_session(session).at_rate(TRUE_HZ).declared


def test_the_session_file_does_the_same(session):
    declare(session, fps_hz=TRUE_HZ, fps_overrules=True)
    assert read_session(session) == read_session(session, fps_hz=TRUE_HZ)
    assert checked(read_session(session)) == [[], []]
    declare(session, fps_hz=45, fps_overrules=True)
    assert read_session(session, fps_hz=TRUE_HZ).recordings[0].fps_hz == TRUE_HZ


def test_two_rates_are_refused(session):
    listed = [{"video": "0/10/video.mp4", "texture": "a", "fps_hz": 80}]
    declare(session, recordings=listed)
    with pytest.raises(InputError, match=r"--fps: expected .* found 80 for a in session\.json"):
        read_session(session, fps_hz=TRUE_HZ)
    with pytest.raises(InputError, match="--fps: expected frames a second, above 0, found -1"):
        read_session(session, fps_hz=-1)


@pytest.mark.parametrize("seconds", [2.9, 3.1])
def test_sound_need_not_be_as_long_to_the_frame(session, seconds):
    for one in read_session(session).recordings:
        soundfile.write(one.audio.path, np.zeros((round(seconds * 8000), 2)), 8000)
    with pytest.raises(InputError, match="the container's rate is wrong: give --fps 90"):
        checked(read_session(session))
    assert checked(read_session(session, fps_hz=TRUE_HZ)) == [[], []]


def test_nothing_is_guessed_where_nothing_fits(session):
    audio = WavFile(session / "0/10/audio.wav")
    said = wrong_rate(100, TOLD_HZ, TRUE_HZ, audio, "session.toml")
    assert said.startswith("declare fps_hz in session.toml; if the container's rate is wrong, give")
    right = wrong_rate(90, TOLD_HZ, TRUE_HZ, audio, "session.toml")
    assert right.endswith("its 90 frames are as long as its sound at 30 a second")
    assert wrong_rate(100, TOLD_HZ, TRUE_HZ, None, "session.toml") == said


def test_a_second_of_sound_may_be_missing_or_too_much(tmp_path, write_video):
    """As recorders are started and stopped one after the other; of 65 s as published."""
    folder = tmp_path / "0/10"
    write_video(folder / "video.mp4", n_frames=650, rate=10, size=(64, 48))
    declared = SessionFile(frame_width=64, frame_height=48, sample_rate_hz=100, fps_hz=10)
    for seconds, steady_s in ((64, None), (66, None), (64, (2.5, 65.0)), (62.6, None)):
        soundfile.write(folder / "audio.wav", np.zeros((round(seconds * 100), 2)), 100)
        (recording,) = read_session(tmp_path).recordings
        recording = type(recording)(**{**vars(recording), "steady_s": steady_s})
        assert check_recording(recording, declared) == [], (seconds, steady_s)
    soundfile.write(folder / "audio.wav", np.zeros((5900, 2)), 100)
    (doubt,) = check_recording(read_session(tmp_path).recordings[0], declared, KINDS)
    assert doubt.kind == "length"


def test_other_data_sets_have_no_frame_rate(tmp_path):
    wav = tmp_path / "a.wav"
    soundfile.write(wav, np.zeros(8000), 8000)
    for source in (wav, f"fabricslide:{tmp_path}"):
        with pytest.raises(InputError, match="--fps: expected a video, or a session of videos"):
            afferents.inspect(source, tmp_path / "out", fps_hz=90)

"""Recordings made elsewhere: their frames stay, their own times count."""

import json
import os
import sys

import av
import numpy as np
import pandas as pd
import pytest
import soundfile
from tests.unit.films import make_images, write_film

import afferents
from afferents.errors import InputError
from afferents.recordings.video import VideoFile
from afferents.rig.camera import RigCamera
from afferents.rig.record import write_film as write_grey_jpegs

N = 60


def bring(video, audio, times, session, texture, speed, start_s=None):
    """Import a recording of a texture at a speed."""
    return afferents.import_recording(
        video,
        audio,
        times,
        session=session,
        texture=texture,
        speed_mm_s=speed,
        audio_start_s=start_s,
    )


@pytest.fixture
def files(tmp_path, make_video):
    """A video, its sound, and true times that no rate of frames would tell."""
    video = make_video(tmp_path / "camera.mp4", np.zeros(N), preset="ultrafast")
    rng = np.random.default_rng(0)
    samples = rng.normal(0, 0.1, (8000, 2))
    soundfile.write(tmp_path / "sound.wav", samples, 8000)
    time_s = 1000.25 + np.arange(N) / 88.5 + rng.uniform(0, 0.001, N)
    pd.DataFrame({"time_s": time_s, "sequence": np.arange(N)}).to_csv(tmp_path / "t.csv")
    return video, tmp_path / "sound.wav", tmp_path / "t.csv", time_s


@pytest.mark.parametrize("start_s", [1000.0, 1000.3])
def test_the_true_times_count(files, tmp_path, start_s):
    video, audio, times, time_s = files
    bring(video, audio, times, tmp_path / "S", "4", 40, start_s)
    (recording,) = afferents.read_session(tmp_path / "S").recordings
    found = list(recording.video.frames())
    samples = recording.audio.read().values[:, 0]
    heard = soundfile.read(audio)[0][:, 1]
    first = len(samples) - len(heard)
    np.testing.assert_allclose(samples[first:], heard, atol=1e-4)
    begun_s = start_s - first / 8000  # of both clocks
    np.testing.assert_allclose([f.time_s for f in found], time_s - begun_s, atol=2e-6)
    for one, other in zip(found, VideoFile(video).frames(), strict=True):
        np.testing.assert_array_equal(one.luma, other.luma)


@pytest.mark.parametrize("subtype", ["FLOAT", "DOUBLE", "PCM_24"])
def test_sound_that_begins_late_stays_as_loud_as_it_was(files, tmp_path, subtype):
    video, audio, times, time_s = files
    heard = 0.5 * np.sin(np.arange(8000) / 5)
    soundfile.write(audio, heard, 8000, subtype)
    bring(video, audio, times, tmp_path / "S", "4", 40, time_s[0] + 0.2)
    written, _ = soundfile.read(tmp_path / "S/4/40/audio.wav")
    np.testing.assert_allclose(written[1600:], heard, atol=1e-4)
    assert not written[:1600].any()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_the_name_of_the_sound_need_not_be_text(files, tmp_path):
    video, audio, times, time_s = files
    named = audio.rename(tmp_path / os.fsdecode(b"\xff.wav"))
    bring(video, named, times, tmp_path / "S", "4", 40, time_s[0] + 0.2)
    assert (tmp_path / "S/4/40/audio.wav").exists()


def test_what_the_session_says_of_repetitions_and_holes_stays(files, tmp_path):
    video, audio, times, _ = files
    session = tmp_path / "S"
    bring(video, audio, times, session, "4", 40)
    (session / "4/40").rename(session / "once")
    (session / "4/40").mkdir()
    (session / "once").rename(session / "4/40/1")
    file = session / "session.json"
    said = json.loads(file.read_text())
    sums = {"4/40/1": said["checksums"]["4/40"]}
    file.write_text(json.dumps({**said, "checksums": sums, "holes": [["4", 60.0], ["0", 40.0]]}))
    bring(video, audio, times, session, "0", 40)
    said = json.loads(file.read_text())
    assert said["checksums"]["4/40/1"] == sums["4/40/1"]
    assert [*said["checksums"]] == ["4/40/1", "0/40"]
    assert said["holes"] == [["4", 60.0]]


def test_recordings_that_were_there_before_make_holes_too(files, tmp_path):
    video, audio, times, _ = files
    session = tmp_path / "S"
    bring(video, audio, times, session, "4", 40)
    (session / "4/40/run.json").unlink()  # as of sessions that were recorded elsewhere
    bring(video, audio, times, session, "2", 60)
    assert len(afferents.read_session(session).recordings) == 2


def test_a_folder_that_no_speed_names_does_not_stop_an_import(files, tmp_path):
    video, audio, times, _ = files
    session = tmp_path / "S"
    bring(video, audio, times, session, "4", 40)
    (session / "notes/spoken").mkdir(parents=True)
    (session / "notes/spoken/audio.wav").touch()
    bring(video, audio, times, session, "4", 60)
    with pytest.raises(InputError, match="named by its speed in mm/s, found 'spoken'"):
        afferents.read_session(session)


def test_b_frames_in_an_avi_are_refused(files, tmp_path):
    _, audio, times, _ = files
    video = tmp_path / "b.avi"
    with av.open(f"{video}", "w") as out:
        stream = out.add_stream("libx264", rate=90, options={"bf": "2", "b_strategy": "0"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for n in range(N):
            grey = np.full((48, 64, 3), 4 * n, np.uint8)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(grey)))
        out.mux(stream.encode())
    with pytest.raises(InputError, match="found B-frames"):
        bring(video, audio, times, tmp_path / "S", "4", 40)


@pytest.mark.parametrize("coded_as", ["JPEG", "AV1"])
def test_frames_are_copied_even_if_nothing_encodes_such(files, tmp_path, coded_as):
    """PyAV has no encoder of grey JPEGs, nor one of the name by which it decodes AV1."""
    _, audio, times, _ = files
    pictures = np.random.default_rng(0).integers(0, 255, (N, 64, 64), np.uint8)
    video = tmp_path / "coded.mp4"
    if coded_as == "AV1":
        write_film(video, pictures, "libsvtav1")
    else:
        camera = RigCamera(width=64, height=64)
        write_grey_jpegs(video, zip(np.arange(N) / 90, pictures, strict=True), camera)
    bring(video, audio, times, tmp_path / "S", "4", 40)
    np.testing.assert_array_equal(make_images(tmp_path / "S/4/40/video.mp4"), make_images(video))


def test_a_video_that_mp4_can_t_hold_is_refused(files, tmp_path):
    _, audio, times, _ = files
    video = write_film(tmp_path / "raw.avi", np.zeros((N, 48, 64), np.uint8), "rawvideo", "gray")
    with pytest.raises(InputError, match=r"raw.avi: expected a video that mp4 .*rawvideo"):
        bring(video, audio, times, tmp_path / "S", "4", 40)


def test_another_joins_after_one_that_was_killed(files, tmp_path, monkeypatch):
    video, audio, times, _ = files
    with monkeypatch.context() as killed:
        # the recording is there by then, but not what the session says of it
        killed.setattr("afferents.lab.recorder.importing._write_session", _stop)
        with pytest.raises(KeyboardInterrupt):
            bring(video, audio, times, tmp_path / "S", "4", 40)
    bring(video, audio, times, tmp_path / "S", "4", 60)
    assert afferents.read_session(tmp_path / "S").speeds_mm_s == (40, 60)
    said = json.loads((tmp_path / "S/session.json").read_text())
    assert set(said["checksums"]) == {"4/40", "4/60"}


def _stop(*_):
    raise KeyboardInterrupt


def test_missing_frames_are_refused_unless_kept(files, tmp_path, fails, run):
    video, audio, times, _ = files
    table = pd.read_csv(times)
    table.loc[30:, ["sequence", "time_s"]] += [3, 3 / 88.5]
    table.to_csv(times)
    command = ["import", video, audio, "--times", times, "--session", tmp_path / "S"]
    command += ["--texture", "4", "--speed", 40]
    assert "3 lost (the first is number 30)" in fails(*command)
    assert not (tmp_path / "S").exists()
    code, said, _ = run(*command, "--keep")
    assert code == 0
    assert "NO   frames: 60 of 63 frames, 3 lost" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.drop(columns="time_s"), "a column time_s"),
        (lambda t: t.iloc[::-1], "times that rise"),
        (lambda t: t.assign(time_s=1000 * t.time_s), "expected times in s, found 0.08.* frames/s"),
        (lambda t: t.iloc[:-1], "expected 59 frames, as there are times, found 60"),
    ],
)
def test_times_that_do_not_fit_are_refused(files, tmp_path, change, said):
    video, audio, times, _ = files
    change(pd.read_csv(times)).to_csv(times)
    with pytest.raises(InputError, match=said):
        bring(video, audio, times, tmp_path / "S", "4", 40)
    assert not (tmp_path / "S").exists()


@pytest.mark.parametrize("start_s", [0.0, 40000.0, float("nan")])
def test_sound_of_another_time_is_refused(files, tmp_path, start_s):
    video, audio, times, _ = files
    with pytest.raises(InputError, match=r"sound while there are frames, 1000\.25"):
        bring(video, audio, times, tmp_path / "S", "4", 40, start_s)
    assert not (tmp_path / "S").exists()

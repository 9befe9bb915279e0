"""A program that is stopped or killed while it records: no finished run is lost, and it goes on."""

import json
import signal
import time

import numpy as np
import pytest

from afferents.recordings.audio import WavFile
from afferents.recordings.video import VideoFile

pytestmark = pytest.mark.system

PLAN = """
textures = ["4"]
speeds_mm_s = [40, 60]
seconds = 0.5
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""
IMPORTS = ["afferents.cli", "afferents.lab.recorder.record"]


@pytest.fixture
def record(launch, tmp_path):
    """Start `record` in a process of its own."""
    plan = tmp_path / "PLAN.toml"
    plan.write_text(PLAN)
    return lambda: launch(["record", plan, tmp_path / "S", "--dry-run", "--quiet"], imports=IMPORTS)


def wait_for_a_run(session, process):
    """Wait until pictures and sound of a run are being written, or all runs are."""
    end_s = time.monotonic() + 60
    while process.poll() is None and not is_running(session):
        assert time.monotonic() < end_s
        time.sleep(0.005)


def is_running(session):
    return any((wav.parent / "video.mp4").is_file() for wav in session.glob(".running-*/audio.wav"))


def finished(session):
    """Return the names of the runs that are whole, and when their files were written."""
    return {path.parent.name: path.stat().st_mtime_ns for path in session.glob("4/*/run.json")}


def kill_while_it_records(record, session, after_s, rng):
    """Kill it; what was finished stays as it is."""
    process = record()
    wait_for_a_run(session, process)
    before = finished(session)
    time.sleep(rng.uniform(0, after_s))
    process.kill()
    process.communicate()
    assert before.items() <= finished(session).items()
    return process.returncode


def require_whole(session):
    said = json.loads((session / "session.json").read_text())
    assert set(said["runs"]) == {"4/40", "4/60"}
    assert said["holes"] == []
    for name, sums in said["checksums"].items():
        assert set(sums) == {"video.mp4", "audio.wav"}, name
        assert len(list(VideoFile(session / name / "video.mp4").frames())) == 180
        assert WavFile(session / name / "audio.wav").n_samples == 2 * 44100
    assert not list(session.glob(".running-*"))


def kills(record, session, n, after_s):
    rng = np.random.default_rng(0)
    codes = [kill_while_it_records(record, session, after_s, rng) for _ in range(n)]
    process = record()
    _, said = process.communicate()
    assert process.returncode == 0, said
    require_whole(session)
    return codes


def test_killed_it_goes_on_where_it_was(record, tmp_path):
    codes = kills(record, tmp_path / "S", 1, 0)  # at once: later it may be done on a busy machine
    assert codes == [-signal.SIGKILL]
    asides = list(tmp_path.glob("S/.aside/*/*"))
    assert asides
    for aside in asides:
        why = json.loads((aside / "why.json").read_text())["why"]
        assert why == "the program ended while it was recorded"
        samples = WavFile(aside / "audio.wav")
        assert samples.n_samples == ((aside / "audio.wav").stat().st_size - 44) // 4


@pytest.mark.slow
def test_fifty_kills_lose_no_finished_run(record, tmp_path):
    for n in range(10):
        kills(record, tmp_path / "S", 5, 0.9)
        if n < 9:
            (tmp_path / "S").rename(tmp_path / f"S{n}")


def test_ctrl_c_stops_the_run_and_keeps_what_there_is(record, tmp_path):
    session = tmp_path / "S"
    process = record()
    wait_for_a_run(session, process)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130
    assert said.splitlines()[-1] == "afferents: stopped; what is finished is kept"
    (aside,) = session.glob(".aside/*/1")
    why = json.loads((aside / "why.json").read_text())["why"]
    assert why == "stopped while it was recorded"
    assert (aside / "frames.csv").is_file()

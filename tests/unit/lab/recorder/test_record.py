"""A plan recorded on simulated devices whose camera sees the rig's film, faults and all."""

import json
import os
import select
import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import soundfile

import afferents
from afferents.errors import InputError
from afferents.folds.held_out import split_named
from afferents.lab.devices import ByHand, MicrophoneSettings
from afferents.lab.devices.drives import growing
from afferents.lab.recorder.devices import Devices, open_devices
from afferents.lab.recorder.gate import Check
from afferents.lab.recorder.plan import read_plan
from afferents.lab.recorder.record import Recorder, ask_in_terminal
from afferents.lab.recorder.rehearsal import Bench, SimulatedCamera, simulate_devices
from afferents.lab.recorder.session import RecordedSession
from afferents.lab.recorder.watch import OnceMoreError, Watch
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.video import VideoFile
from afferents.rig import Rig, bumped_surface, project
from afferents.rig.run import simulate_run
from afferents.store.drum_path import MARK, Drum, logged_path, read_path
from afferents.store.responses import steady_s

from ....limits import files_no_larger_than
from .faulty import faulty_devices

pytestmark = pytest.mark.system  # devices keep real time

PLAN = """
textures = ["4"]
speeds_mm_s = [60]
seconds = 0.5
redo = {redo}
drum_mm = 80
drum_zero = "mark"
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""
RUN = "4/60"
LOST, DAMAGED = [40, 41, 100], [70]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """One film for all tests of this file: it takes a second to simulate."""
    path = tmp_path_factory.mktemp("plan") / "PLAN.toml"
    path.write_text(PLAN.format(redo=0))
    return Bench(Rig(), read_plan(path), speed=4)


@pytest.fixture(scope="module")
def begin(bench, tmp_path_factory):
    """Return a recording of the same run with faults of its own."""

    def begin(redo=1, **faults):
        path = tmp_path_factory.mktemp("plan") / "PLAN.toml"
        path.write_text(PLAN.format(redo=redo))
        plan, devices = read_plan(path), faulty_devices(bench, **faults)
        return Recorder(plan, path, load_sensor("tip_b"), devices, bench=bench)

    return begin


def made(recorder, session, again=()):
    with Progress(quiet=True) as progress:
        return recorder.record(session, progress, again)


@pytest.fixture(scope="module")
def faulty(begin, tmp_path_factory):
    """A session whose first attempt lost frames, and what came of it."""
    session = tmp_path_factory.mktemp("session") / "S"
    return session, made(begin(lost=LOST, damaged=DAMAGED), session)


def origin_s(log):
    return json.loads(log.read_text().partition("\n")[0].removeprefix("#"))["origin_s"]


def test_lost_frames_are_found_at_exactly_these_and_the_run_is_recorded_again(faulty):
    session, outcome = faulty
    ((place, why),) = outcome.attempts_aside
    assert "3 lost (the first is number 40), 1 damaged (the first is number 70)" in why
    frames = pd.read_csv(f"{place}/frames.csv", skiprows=1).set_index("sequence")
    missing = sorted(set(range(frames.index[0], frames.index[-1])) - set(frames.index))
    assert missing == LOST
    assert frames.index[frames.damaged].tolist() == DAMAGED
    assert (session / ".aside/4~60/1/damaged/70").is_file()
    assert len(list(VideoFile(session / ".aside/4~60/1/video.mp4").frames())) == len(frames) - 1
    assert (outcome.recorded, outcome.kept_aside, outcome.remaining) == ([RUN], {}, [])
    said = json.loads((session / "session.json").read_text())
    assert said["runs"][RUN]["frames"]["lost"] == []
    assert said["simulated"] is True
    assert [r.name for r in read_session(session).recordings] == [RUN]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sensor_channel": 7}, "sensor_channel below 2"),
        ({"seconds": 2.0}, "plan.seconds 2.0"),
    ],
)
def test_what_the_microphone_or_the_session_cannot_be_is_refused(
    begin, faulty, tmp_path, change, said
):
    recording = begin()
    recording = replace(recording, plan=recording.plan.model_copy(update=change))
    with pytest.raises(InputError, match=said):
        made(recording, faulty[0] if "plan" in said else tmp_path / "S")


def test_a_dry_run_is_not_too_long_and_needs_to_be_asked_for(fails, tmp_path):
    plan = tmp_path / "PLAN.toml"
    plan.write_text(PLAN.format(redo=0))
    assert "give --dry-run" in fails("record", plan, tmp_path / "S")
    plan.write_text(plan.read_text().replace("seconds = 0.5", "seconds = 500.0"))
    assert "at most 120 s in a dry run" in fails("record", plan, tmp_path / "S", "--dry-run")


def test_the_sensor_goes_along_with_the_recordings(begin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    packaged = Path(afferents.__file__).parent / "markers/sensors/tip_b.toml"
    shutil.copy(packaged, "mine.toml")
    recording = begin()
    recording = replace(recording, plan=recording.plan.model_copy(update={"sensor": "mine.toml"}))
    made(recording, tmp_path / "S")
    Path("mine.toml").unlink()
    assert json.loads((tmp_path / "S/session.json").read_text())["sensor"] == "sensor.toml"
    (responses,) = afferents.extract(tmp_path / "S", tmp_path / "S.zarr", workers=1, quiet=True)
    assert responses.sizes["marker"] == 361


@pytest.fixture(scope="module")
def responses(faulty):
    session, _ = faulty
    (found,) = afferents.extract(session, session.parent / "S.zarr", workers=1, quiet=True)
    return found


def test_the_tracks_are_those_of_the_film(faulty, begin, bench, responses):
    plan = begin().plan
    session, _ = faulty
    frames = pd.read_csv(session / RUN / "frames.csv", skiprows=1)
    at_s = frames.time_s - origin_s(session / RUN / "frames.csv")
    np.testing.assert_allclose(responses.time, at_s, atol=1e-6)
    (entry,) = plan.entries()
    rig, run = bench.rig, (plan.total_s + 0.5, plan.seed, entry.seed)
    moved = simulate_run(rig, "4", bumped_surface(4.0, rig.drum), 60.0, *run)
    true = project(moved.position_mm, rig.camera)[frames.sequence]
    found = responses.position.values
    seen = slice(responses.attrs["rest_frame"], None)
    assert responses.detected.values[seen].all()
    away = np.linalg.norm(true[20][None] - found[20][:, None], axis=2)
    error = np.linalg.norm(found - true[:, away.argmin(axis=1)], axis=2)[seen]
    assert np.sqrt((error**2).mean()) < 0.1


def test_the_angle_is_that_of_the_film(faulty, bench, responses):
    """As a drive on the drum's own clock is read: what is between two reads is a straight line."""
    session, _ = faulty
    way = logged_path(session / RUN)
    frames = pd.read_csv(session / RUN / "frames.csv", skiprows=1)
    time_s = frames.time_s - origin_s(session / RUN / "frames.csv")
    error = way.at(time_s) - bench.film.way_mm[frames.sequence]
    assert np.abs(error).max() < 0.5
    assert way.drum == Drum(circumference_mm=np.pi * 80, contact_mm=16, zero=MARK)
    stored, at_steady = read_path(responses), np.linspace(*steady_s(responses))
    np.testing.assert_allclose(stored.at(at_steady), way.at(at_steady), atol=1e-3)
    with pytest.raises(InputError, match=r"turns at least once in each recording, found 0\.1"):
        split_named("angle").groups_of([responses])


def test_positions_count_anew_when_the_drive_was_opened_again(begin):
    plan = begin().plan
    assert plan.drum("now", "4").zero == MARK
    started = plan.model_copy(update={"drum_zero": "start"})
    assert started.drum("now", "4").zero != started.drum("later", "4").zero
    assert started.drum("now", "4").zero != started.drum("now", "2").zero
    assert plan.model_copy(update={"drum_mm": None}).drum("now", "4") is None
    geared = {"drum_mm": None, "drive": {"kind": "dynamixel", "diameter_mm": 60.0}}
    assert plan.model_copy(update=geared).drum("now", "4").circumference_mm == np.pi * 60


def test_the_sound_is_that_of_the_film_and_on_the_same_clock(faulty, bench):
    session, _ = faulty
    samples, rate = soundfile.read(session / RUN / "audio.wav", dtype="int16")
    blocks = pd.read_csv(session / RUN / "sound.csv", skiprows=1)
    frames = pd.read_csv(session / RUN / "frames.csv", skiprows=1)
    begun_s = frames.time_s[0] - bench.film.time_s[frames.sequence[0]]  # of the film
    first = round((blocks.time_s[0] - begun_s) * rate)
    np.testing.assert_array_equal(samples, bench.film.sound[first : first + len(samples)])
    assert len(samples) == round(2.0 * rate)
    said = json.loads((session / "session.json").read_text())["runs"][RUN]["sound_clock"]
    assert abs(said["seconds"]) < 1e-6


def test_what_is_finished_is_not_recorded_again(faulty, begin, tmp_path):
    session, _ = faulty
    assert made(begin(), session).recorded == []
    shutil.copytree(session, tmp_path / "S")
    shutil.rmtree(tmp_path / "S" / "4")
    assert made(begin(), tmp_path / "S").recorded == [RUN]


def test_devices_of_other_rates_make_no_runs_of_a_session(begin, faulty, tmp_path):
    shutil.copytree(faulty[0], tmp_path / "S")
    before, recorder = (tmp_path / "S/session.json").read_bytes(), begin()
    kept = RecordedSession(tmp_path / "S", recorder.plan, simulated=True)
    with open_devices(recorder.devices, recorder.plan, recorder.path):
        recorder.devices.microphone.settings = MicrophoneSettings("another", 48_000.0, 2)
        with pytest.raises(InputError, match=r"sample_rate_hz 44100, as in .*json, found 48000"):
            kept.begin(recorder.devices)
    assert (tmp_path / "S/session.json").read_bytes() == before


def test_there_must_be_room_for_what_is_still_missing(begin, tmp_path, monkeypatch):
    recorder, session, asked = begin(), tmp_path / "S", []
    plan = recorder.plan.model_copy(update={"speeds_mm_s": (60.0, 80.0)})
    with open_devices(recorder.devices, plan, recorder.path):
        RecordedSession(session, plan, simulated=True).begin(recorder.devices)
    (session / "4/80").mkdir(parents=True)
    (session / "4/80/run.json").write_text('{"checksums": {}}')
    monkeypatch.setattr(
        "afferents.lab.recorder.record.preflight",
        lambda *given: asked.append(given[-1]) or [Check("all", False, "enough")],
    )
    with pytest.raises(InputError, match="enough"):
        made(replace(recorder, plan=plan), session)
    assert asked == [1]


def test_an_unplugged_device_is_waited_for(begin, tmp_path, monkeypatch):
    tried, said, opened = [], [], SimulatedCamera.open

    def open_late(camera):
        tried.append(camera)
        if len(tried) in (2, 3, 4):
            said.append(recorder.watch.state()["say"])
            raise InputError(f"there is no camera, try {len(tried) // 3}")
        opened(camera)

    monkeypatch.setattr(SimulatedCamera, "open", open_late)
    monkeypatch.setattr("afferents.lab.recorder.devices.AGAIN_S", 0.0)
    recorder = begin(redo=1, unplugged_at=90)
    assert made(recorder, tmp_path / "S").recorded == [RUN]
    assert all(one.startswith(f"{RUN}: waiting for the devices: ") for one in said)
    notes = [note for note in recorder.watch.state()["notes"] if "no camera" in note]
    assert [note[:27] for note in notes] == [f"there is no camera, try {n}; " for n in (0, 1)]
    del tried[1:]
    monkeypatch.setattr("afferents.lab.recorder.devices.PLUGGED_IN_S", -1.0)
    with pytest.raises(InputError, match="no camera"):
        recorder.devices.reopen(lambda: None, str)
    with pytest.raises(KeyboardInterrupt):
        recorder.devices.reopen(interrupt, str)


def test_a_camera_that_comes_back_otherwise_is_said_or_refused(begin, tmp_path, monkeypatch):
    opened = SimulatedCamera.open
    settings = {"controls": {"exposure_ms": 8.0}}

    def open_otherwise(camera):
        opened(camera)
        camera.settings = replace(camera.settings, **settings)
        settings["controls"] = {"exposure_ms": 33.0}

    monkeypatch.setattr(SimulatedCamera, "open", open_otherwise)
    recorder = begin(redo=1, unplugged_at=90)
    assert made(recorder, tmp_path / "S").recorded == [RUN]
    notes = recorder.watch.state()["notes"]
    assert "the camera came back with exposure_ms 33; [camera] may set these" in notes
    about = json.loads((tmp_path / "S" / RUN / "run.json").read_text())
    assert about["camera"]["controls"] == {"exposure_ms": 33.0}
    recorder = begin(redo=1, unplugged_at=90)
    settings["fps_hz"] = 90.0

    def half_as_fast(camera):
        open_otherwise(camera)
        settings["fps_hz"] = 45.0

    monkeypatch.setattr(SimulatedCamera, "open", half_as_fast)
    with pytest.raises(InputError, match=r"expected fps_hz 90, .* found 45"):
        made(recorder, tmp_path / "S", again=[RUN])


def test_who_wants_the_last_run_once_more_is_asked_for_its_drum_again(bench, tmp_path):
    path = tmp_path / "PLAN.toml"
    text = PLAN.format(redo=0)
    path.write_text(text.replace('["4"]', '["4", "2"]').replace('"mark"', '"start"'))
    plan, asked = read_plan(path), []
    first, second = (entry.texture for entry in plan.entries())

    def ask(sentence):
        asked.append(sentence.split(",")[0].removeprefix("change the drum to "))
        if len(asked) in (1, 3, 4):  # at the first there is none yet, the last is asked for already
            raise OnceMoreError

    devices = simulate_devices(plan, path, bench)
    recorder = Recorder(plan, path, load_sensor("tip_b"), devices, ask, bench)
    assert len(made(recorder, tmp_path / "S").recorded) == 2
    assert asked == [first, first, second, first, first, second]
    folders = [f"{first}/60", f"{second}/60"]
    zeros = {logged_path(tmp_path / "S" / name).drum.zero.rpartition(" ")[0] for name in folders}
    (aside,) = (tmp_path / "S/.aside" / folders[0].replace("/", "~")).iterdir()
    zeros.add(logged_path(aside).drum.zero.rpartition(" ")[0])
    assert len(zeros) == 2  # before the drum was taken off, and after


def test_what_was_typed_during_a_run_answers_nothing(monkeypatch):
    pty = pytest.importorskip("pty", reason="no pseudo-terminals here")
    master, slave = pty.openpty()
    monkeypatch.setattr("sys.stdin", os.fdopen(slave))
    os.write(master, b"r\n")
    assert select.select([slave], [], [], 60)[0]  # it is there before anybody is asked
    shown = "afferents.lab.recorder.record.show_in_terminal"
    monkeypatch.setattr(shown, lambda _: os.write(master, b"\n"))
    ask_in_terminal("change the drum to 4")  # raises OnceMoreError where the r was taken
    os.close(master)


def interrupt():
    raise KeyboardInterrupt


class AskedLate(Watch):
    """The first attempt is requested once more just after the drive was read last."""

    asked = False

    def say(self, sentence, ended=False):
        if sentence.endswith("is it good enough?"):
            self.wants_redo, self.asked = not self.asked, True
        super().say(sentence, ended)


def test_once_more_opens_no_device_anew_and_is_not_lost_at_the_end(begin, tmp_path, monkeypatch):
    monkeypatch.setattr(Devices, "reopen", lambda *_: pytest.fail("no device was gone"))
    outcome = made(replace(begin(redo=0), watch=AskedLate()), tmp_path / "S")
    ((_, why),) = outcome.attempts_aside
    assert why == "it was requested once more"
    assert outcome.recorded == [RUN]


def test_an_accepted_run_that_is_recorded_again_is_kept_aside_and_named(faulty, begin, tmp_path):
    shutil.copytree(faulty[0], tmp_path / "S")
    before = (tmp_path / "S" / RUN / "frames.csv").read_bytes()
    recorder = begin(redo=0, lost=[40, 41, 42])
    refused = made(recorder, tmp_path / "S", again=[RUN])
    assert (refused.recorded, [*refused.kept_aside]) == ([], [RUN])
    assert refused.kept_aside[RUN].endswith("; the earlier one stays")
    assert recorder.watch.state()["done"] == 1
    assert (tmp_path / "S" / RUN / "frames.csv").read_bytes() == before
    outcome = made(begin(), tmp_path / "S", again=[RUN])
    assert (outcome.recorded, outcome.remaining, outcome.kept_aside) == ([RUN], [], {})
    ((place, why),) = outcome.attempts_aside
    assert why == "accepted, and another was recorded in its place"
    assert (Path(place) / "frames.csv").read_bytes() == before
    assert json.loads((Path(place) / "why.json").read_text())["why"] == why
    assert (tmp_path / "S" / RUN / "frames.csv").read_bytes() != before
    with pytest.raises(InputError, match=r"runs of the plan \(4/60\), found '9/9'"):
        made(begin(), tmp_path / "S", again=["9/9"])


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({"unplugged_at": 90}, "it was unplugged"),
        ({"repeated": [60, 61, 62]}, "3 repeated"),
        ({"gone_at_s": 0.8}, "it was unplugged"),
        ({"silent": True}, "peak 0.0%"),
        ({"overflow_at_s": 0.8}, "1 overflows"),
        ({"off": 0.1}, "speed"),
        ({"fault_at_s": 1.2}, "over current"),
    ],
)
def test_a_run_with_a_fault_is_kept_aside_and_named(begin, bench, tmp_path, fault, said):
    outcome = made(begin(redo=0, **fault), tmp_path / "S")
    assert said in outcome.kept_aside[RUN]
    assert outcome.remaining == [RUN]
    assert bench.set_mm_s == 0  # the drum stands still
    aside = tmp_path / "S/.aside/4~60/1"
    assert said in json.loads((aside / "why.json").read_text())["why"]
    assert len(pd.read_csv(aside / "frames.csv", skiprows=1)) > 40
    assert len(list(VideoFile(aside / "video.mp4").frames())) > 40


def test_a_person_changes_drums_once_and_turns_them_where_no_motor_does(begin):
    recorder = begin()
    plan, asked = recorder.plan, []
    with ByHand() as drive:
        devices = replace(recorder.devices, drive=drive)
        asking = replace(recorder, devices=devices, ask=asked.append, bench=None)
        for attempt in range(3):
            asking.mount(plan.entries()[0], attempt)
    assert asked[0] == "change the drum to 4, then press enter"
    assert len(asked) == 3
    assert "turn it at 60 mm/s until 2 s are over" in asked[1]


def test_an_arm_that_another_program_moves_is_recorded_as_a_sweep(tmp_path, monkeypatch):
    path, log = tmp_path / "PLAN.toml", tmp_path / "arm.csv"
    swept = PLAN.replace("[60]", "[20, 80]\nsweep = true").replace("drum_mm = 80", "drum_mm = 1000")
    path.write_text(swept.format(redo=0))
    plan = read_plan(path)
    bench = Bench(Rig(), plan, speed=4)
    now, over = bench.clock.now, threading.Event()
    monkeypatch.setattr(growing, "time", SimpleNamespace(monotonic=now, sleep=time.sleep))

    class Arm(growing.GrowingLog):
        def start(self, speed_mm_s):
            bench.set_mm_s = speed_mm_s  # so that there is something to hear

    def write():
        with log.open("w", buffering=1) as file:
            file.write("timestamp,position_mm\n")
            while not over.wait(0.002):
                t = now()
                file.write(f"{t:.4f},{50 * t + 10 * np.sin(3 * t):.4f}\n")

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    while not log.is_file() or log.stat().st_size < 100:
        assert writer.is_alive()
    arm = Arm(growing.GrowingLogOptions(path=log))
    devices = replace(simulate_devices(plan, path, bench), drive=arm)
    recorder = Recorder(plan, path, load_sensor("tip_b"), devices, bench=bench)
    outcome = made(recorder, tmp_path / "S")
    over.set()
    writer.join()
    assert (outcome.recorded, outcome.attempts_aside) == (["4/sweep/1"], [])
    (recording,) = read_session(tmp_path / "S").recordings
    assert (recording.name, recording.speed_mm_s) == ("4/sweep/1", None)
    assert recording.steady_s == plan.steady_s
    said = json.loads((tmp_path / "S/session.json").read_text())
    assert said["drive"] == {"lowest_mm_s": 0.0, "highest_mm_s": None}  # it is no motor
    way = logged_path(recording.source)
    speed = np.diff(way.at(np.array([0.5, 1.0, 1.5]))) / 0.5
    assert ((speed > 15) & (speed < 85)).all()
    assert recorder.record(tmp_path / "S", Progress(quiet=True)).recorded == []  # it goes on


def test_a_full_disk_is_one_sentence_and_what_there_is_is_kept(begin, bench, tmp_path):
    session = tmp_path / "S"
    with files_no_larger_than(1 << 20), pytest.raises(InputError, match="make room on the disk"):
        made(begin(), session)
    assert bench.set_mm_s == 0
    assert (session / ".aside/4~60/1/frames.csv").is_file()
    assert made(begin(), session).recorded == [RUN]

"""Before a plan: what is refused there would be refused after every run."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from afferents.lab.devices.base import (
    Block,
    CameraSettings,
    DriveLimits,
    DriveState,
    Frame,
    MicrophoneSettings,
)
from afferents.lab.recorder.plan import RecordingPlan
from afferents.lab.recorder.preflight import check_microphone, check_rate, check_speeds


def planned(**more):
    return RecordingPlan(
        textures=["4"], speeds_mm_s=[80, 100], camera={}, **{"seconds": 58.5} | more
    )


def frames(rate_hz, jitter_s=0.0, seed=0):
    """A second and a half of a camera, each frame late by some."""
    late_s = np.random.default_rng(seed).exponential(jitter_s, round(1.5 * rate_hz))
    return [Frame(n, n / rate_hz + late, False, b"") for n, late in enumerate(late_s.tolist())]


def checked(said_hz, seen, **plan):
    return check_rate(CameraSettings("mine", "MJPG", 640, 480, said_hz), seen, planned(**plan))


@pytest.mark.parametrize(
    ("rate_hz", "plan", "passes"),
    [
        (90, {}, True),
        (89.5, {}, False),  # 30 frames too few in each run
        (89.5, {"tolerance": {"lost": 0.01}}, True),
        (89.5, {"seconds": 1.0}, True),  # one frame too few is none
        (90.5, {}, True),
        (87, {"tolerance": {"lost": 0.5}}, False),
        (93, {}, False),
    ],
)
def test_a_camera_too_slow_for_the_runs_is_refused_before_them(rate_hz, plan, passes):
    assert checked(90.0, frames(rate_hz), **plan).passes == passes


@pytest.mark.parametrize("seed", range(20))
def test_frames_that_are_late_now_and_then_are_no_slow_camera(seed):
    assert checked(90.0, frames(90, 0.003, seed)).passes


def test_a_camera_that_names_no_rate_is_refused_with_what_to_do():
    line = checked(math.nan, frames(90)).describe()
    assert line.startswith("NO   camera: 640 x 480 MJPG at nan frames/s, measured 90.00")
    assert "fps_hz as measured" in line


def test_a_sound_server_s_stamps_are_no_wrong_rate():
    """The first comes 0.14 s early, and one in five up to 60 ms late."""
    rng = np.random.default_rng(0)
    late = np.where(rng.random(150) < 0.2, rng.uniform(0, 0.06, 150), 0)
    late[0] = -0.14
    samples = np.full((441, 2), 1000, np.int16)
    blocks = [Block(t, samples, False) for t in (0.01 * np.arange(150) + late).tolist()]
    settings = MicrophoneSettings("mine", 44_100.0, 2)
    assert all(check.passes for check in check_microphone(settings, blocks, planned()))


class Clock:
    """Goes on when it is waited for."""

    at_s = 0.0

    def now(self):
        return self.at_s

    def wait(self, seconds):
        self.at_s += seconds


class Motor:
    """Gets faster and slower by 60 mm/s in a second."""

    limits = DriveLimits(1.0, 200.0)

    def __init__(self, clock):
        self.clock, self.aim_mm_s, self.speed_mm_s, self.seen_s = clock, 0.0, 0.0, 0.0

    def start(self, speed_mm_s):
        self.read()
        self.aim_mm_s = speed_mm_s

    def stop(self):
        self.start(0.0)

    def read(self):
        most = 60 * (self.clock.now() - self.seen_s)
        self.speed_mm_s += float(np.clip(self.aim_mm_s - self.speed_mm_s, -most, most))
        self.seen_s = self.clock.now()
        return DriveState(self.seen_s, 0.0, self.speed_mm_s, None)


def test_every_speed_is_reached_from_rest():
    clock = Clock()
    devices = SimpleNamespace(clock=clock, drive=Motor(clock))
    first, second = check_speeds(devices, planned(settle_s=1.5))
    assert first.passes
    assert second.describe().startswith("NO   speed 100 mm/s: reached after 1.5")
    assert devices.drive.speed_mm_s < 5  # at rest before the first run


@pytest.mark.parametrize(
    ("answers", "found"),
    [
        ([(None, None)], "unknown: nothing reads the drum"),
        ([(60.0, None), (None, None)], "nan mm/s at last"),
        ([(60.0, None)] * 3 + [(math.nan, "its speed is nan")], "a fault: its speed is nan"),
        # Reached, and broken while the drum comes to rest.
        ([(60.0, None)] * 6 + [(50.0, "its speed is nan")], "a fault: its speed is nan"),
    ],
)
def test_a_drive_that_answers_once_or_wrongly_is_refused(answers, found):
    clock = Clock()
    left = list(answers)

    def read():
        speed, fault = left.pop(0) if len(left) > 1 else left[0]
        return DriveState(clock.now(), None, speed, fault)

    drive = SimpleNamespace(start=lambda speed: None, stop=lambda: None, read=read)
    drive.limits = DriveLimits(1.0, 200.0)
    devices = SimpleNamespace(clock=clock, drive=drive)
    (check,) = check_speeds(devices, planned().model_copy(update={"speeds_mm_s": (60,)}))
    assert check.found.endswith(found)
    assert check.passes == found.startswith("unknown")


def test_an_arm_that_another_program_moves_need_not_reach_a_speed():
    clock = Clock()
    drive = SimpleNamespace(start=lambda speed: None, stop=lambda: None)
    drive.read, drive.limits = lambda: DriveState(0.0, 0.0, 35.0, None), DriveLimits(0.0, math.inf)
    devices, begun_s = SimpleNamespace(clock=clock, drive=drive), clock.now()
    (check,) = check_speeds(devices, planned().model_copy(update={"speeds_mm_s": (60,)}))
    assert (check.passes, check.found) == (True, "not tried: it reads 35.00 mm/s now")
    assert clock.now() - begun_s < 0.1


def test_a_camera_whose_frames_have_one_number_is_refused():
    seen = [frame._replace(sequence=0) for frame in frames(90)]
    assert checked(90.0, seen).found.endswith("but its frames repeat numbers")
    seen = [frame._replace(sequence=(frame.sequence + 200) % 256) for frame in frames(90)]
    assert checked(90.0, seen).passes

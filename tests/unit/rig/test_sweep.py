"""A sweep: speed and depth go up and down within a slide, and an arm logs its pose and force."""

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents.errors import InputError
from afferents.recordings.data_sets import read_session
from afferents.rig import STEADY_S, bumped_surface
from afferents.rig.drive import Slide
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.run import simulate_run
from afferents.rig.simulation import make_simulation

SWEEP = Slide(20.0, 80.0, False, speed_phase=0.0, depth_phase=0.0, deeper_mm=0.1, change_mm=0.2)
SLOW_S, FAST_S = (6.0, 7.0), (3.0, 4.0)
"""When its speed stays."""
SPACING_MM = 2.0


@pytest.fixture(scope="module")
def swept(quiet_rig):
    surface = bumped_surface(SPACING_MM, quiet_rig.drum)
    return simulate_run(quiet_rig, "2", surface, 50.0, 7.0, seed=0, slide=SWEEP)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept") / "session"
    words = {"textures": "a", "sweep": "20:80", "repetitions": 2, "seconds": 2.0}
    return afferents.simulate(folder, **words, workers=1, quiet=True).root


def test_speed_stays_between_both_and_accelerates_evenly():
    time = np.arange(0, 6, 0.01)
    speed = SWEEP.speed_at(time)
    assert (speed.min(), speed.max(), speed.mean()) == pytest.approx((20, 80, 50))
    assert set(np.round(np.diff(speed) / 0.01, 6)) == {-30.0, 0.0, 30.0}
    sine = SWEEP._replace(is_sine=True).speed_at(time)
    np.testing.assert_allclose(sine, 50 - 30 * np.cos(2 * np.pi * time / 6))


def test_the_pose_moves_at_the_commanded_speed_and_depth(swept, quiet_rig):
    time, x, _, z = swept.arm[0][:, :4].T
    assert np.diff(time) == pytest.approx(1 / 125)
    between = (time[1:] + time[:-1]) / 2
    steady = between > STEADY_S
    speed = 1000 * np.diff(x) * 125
    np.testing.assert_allclose(speed[steady], SWEEP.speed_at(between[steady]), atol=0.2)
    usual = quiet_rig.mounting.indentation_mm
    assert np.ptp(z[time > STEADY_S]) == pytest.approx(0.4e-3, rel=0.01)
    assert z[time > 1.6].mean() == pytest.approx(-(usual + 0.1) / 1000, abs=0.05e-3)


@pytest.mark.parametrize(("when", "speed"), [(SLOW_S, 20.0), (FAST_S, 80.0)])
def test_vibration_has_its_lines_where_the_speed_is_just_then(swept, quiet_rig, when, speed):
    first, last = (round(at * SAMPLE_RATE_HZ) for at in when)
    heard = swept.sensor[first:last] * np.hanning(last - first)
    power = np.abs(np.fft.rfft(heard)) ** 2  # 1 Hz apart, as the second is long
    rate = quiet_rig.drum.rate_hz(SPACING_MM, speed)
    peak = 1 + power[1 : round(2.5 * rate)].argmax()
    assert min(abs(peak - rate), abs(peak - 2 * rate)) <= 1


def test_the_force_is_what_the_skin_feels(swept, quiet_rig):
    time, along, _, normal = swept.arm[1][:, :4].T
    assert np.diff(time) == pytest.approx(1 / 500)
    of_frames = swept.pressure_mn.sum(axis=1) / 1000
    steady = swept.time_s > STEADY_S
    at = np.interp(swept.time_s[steady], time, normal)
    np.testing.assert_allclose(at, of_frames[steady], rtol=0.1)
    assert (along[time > STEADY_S] < 0).all()  # against the slide
    drag = -along[time > STEADY_S].mean() / normal[time > STEADY_S].mean()
    assert 0.3 < drag < 1.2 * quiet_rig.skin.friction
    depth = -np.interp(time, *swept.arm[0][:, [0, 3]].T)
    assert np.corrcoef(depth[time > STEADY_S], normal[time > STEADY_S])[0, 1] > 0.7


def test_a_session_lists_recordings_without_a_speed_and_the_logs_beside(session):
    first, second = read_session(session).recordings
    assert (first.name, second.name) == ("0/sweep/1", "0/sweep/2")
    assert first.speed_mm_s is None
    assert first.steady_s == (STEADY_S, 2.0)
    assert first.conditions["repetition"] == "1"
    assert {path.name for path in first.source.iterdir()} == {
        "video.mp4", "audio.wav", "truth.npz", "throw_away.mp4", "robot_data.csv",
        "ft_sensor_data.csv",
    }  # fmt: skip
    head = pd.read_csv(first.source / "ft_sensor_data.csv").columns
    axes = [f"{what}_{axis}" for what in ("force", "torque") for axis in "xyz"]
    assert list(head) == ["timestamp", *axes]
    head = pd.read_csv(first.source / "robot_data.csv").columns
    assert list(head) == ["timestamp", *(f"actual_TCP_pose_{n}" for n in range(6))]


def test_its_store_holds_pose_and_force(session, tmp_path):
    responses = afferents.extract(session, tmp_path / "s.zarr", workers=1, quiet=True)[0]
    assert responses.pose.dims == ("pose_time", "pose_axis")
    assert responses.force.dims == ("force_time", "force_axis")
    assert responses.pose.attrs["units"] == "m, rad"
    truth = np.load(session / "0/sweep/1/truth.npz")
    np.testing.assert_allclose(responses.time, truth["time"], atol=1e-4)  # one clock
    x = responses.pose.sel(pose_axis="actual_TCP_pose_0").interp(pose_time=truth["time"])
    way = (truth["drum_angle_rad"] - truth["drum_angle_rad"][0]) * 40e-3
    np.testing.assert_allclose(x[:-1], way[:-1], atol=2e-5)


def test_a_slide_that_lost_a_log_is_recorded_again(session):
    lost = session / "0/sweep/2/robot_data.csv"
    before = lost.read_bytes()
    lost.unlink()
    words = {"textures": "a", "sweep": "20:80", "repetitions": 2, "seconds": 2.0}
    afferents.simulate(session, **words, workers=1, quiet=True)
    assert lost.read_bytes() == before


def test_repetitions_differ_in_phase_and_depth_and_textures_do_not():
    runs = make_simulation("s", "quick", textures="ag", sweep="20:80:sine").config()["runs"]
    drawn = [[run[k] for k in ("speed_phase", "deeper_mm")] for run in runs.values()]
    assert drawn[:4] == drawn[4:]
    phase, deeper = np.array(drawn[:4]).T
    assert sorted(np.floor(4 * phase)) == [0, 1, 2, 3]
    assert sorted(np.floor((deeper + 0.2) * 10)) == [0, 1, 2, 3]


@pytest.mark.parametrize("text", ["80:20", "0:50", "20:20", "20:600", "fast", "20", "20:80:round"])
def test_what_is_no_sweep_is_refused(fails, tmp_path, text):
    assert f"found '{text}'" in fails("simulate", tmp_path / "new", "--sweep", text, "--quiet")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"sweep": "20:80", "speeds_mm_s": [50]}, "--speeds"),
        ({"repetitions": 2}, "--repetitions"),
        ({"sweep": "20:80", "repetitions": 0}, "--repetitions"),
        ({"sweep": "20:80", "indentation_mm": 1.8}, "--indentation"),
    ],
)
def test_what_does_not_go_with_a_sweep_is_refused(words, said):
    with pytest.raises(InputError, match=f"^{said}: expected"):
        make_simulation("s", "quick", **words)

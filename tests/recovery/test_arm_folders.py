"""Folders of fingertips on arms, made from the simulated rig: what comes back of what is known."""

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

import afferents
from afferents.errors import InputError
from afferents.extraction.clocks import describe, measure_clocks, measure_lag, set_clocks
from afferents.markers.session_sensors import find_sensors
from afferents.rig import Rig
from afferents.store.log import Lag

sys.path.append(str(Path(__file__).resolve().parents[2] / "scripts"))
import arm_folders

BEGINS, DRIFT = arm_folders.COMPUTER_UPTIME_S, 50e-6
APART_S = 300.0


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    root = tmp_path_factory.mktemp("arm") / "runs"
    arm_folders.write_runs(root, spacings=(3.0,), apart_s=APART_S)
    return root


def write_logs(root, offset_s, drift):
    """Write pose and force anew, with clocks so far ahead."""
    time_s, depth, _ = arm_folders.pressed(Rig(), 2.8)
    ends = np.array([0.0, 1.9])
    still, way = (ends, np.ones(2)), (ends, 50.0 * ends)
    for run, z in enumerate(((time_s, depth), still)):
        began_s = BEGINS + 1 + run * APART_S
        arm_folders.write_logs(root / f"run_{run}", began_s, z, (offset_s, -offset_s), drift, way)


@pytest.mark.parametrize("offset_ms", [5, 20, 50])
def test_clocks_are_set_by_the_press_within_a_frame_or_what_is_said(runs, offset_ms):
    write_logs(runs, offset_ms / 1000, DRIFT)
    session = afferents.read_session(runs)
    lags = measure_clocks(session, find_sensors(session, None))
    assert all(lag.error_s < 0.015 for lag in lags.values())
    (run,) = set_clocks(session, lags).recordings
    for log in run.beside:
        found = log.variable(run.video.began_s)
        rate_hz = arm_folders.ROBOT_HZ if log.name == "pose" else arm_folders.FORCE_HZ
        true_s = np.arange(len(found)) / rate_hz
        off_s = np.abs(found[f"{log.name}_time"].values - true_s).max()
        assert off_s < max(1 / arm_folders.FPS, found.attrs["clock_error_s"])
        assert lags[log.name].seconds == pytest.approx(
            (arm_folders.ROBOT_UPTIME_S - BEGINS + offset_ms / 1000) * (log.name == "pose")
            - offset_ms / 1000 * (log.name == "force"),
            abs=max(0.5 / arm_folders.FPS, lags[log.name].error_s),
        )


def test_runs_are_extracted_with_pose_and_force_beside(runs, run, tmp_path):
    write_logs(runs, 0.02, DRIFT)
    code, _, err = run("extract", runs, tmp_path / "out.zarr", "--workers", "1", "--quiet")
    assert code == 0
    assert "The clock of 'force' is" in err
    (found,) = afferents.open_responses(tmp_path / "out.zarr")
    assert found.pose.dims == ("pose_time", "pose_axis")
    assert found.force.attrs["units"] == "N"
    assert found.attrs["normal_force"] == "-force_z"
    assert abs(float(found.speed[found.speed_time.values > 0.5].mean()) - 50) < 0.5
    x = found.pose.sel(pose_axis="actual_TCP_pose_0")
    speed = np.gradient(1000 * x.values, found.pose_time.values)
    assert np.median(speed) == pytest.approx(found.attrs["speed_mm_s"], rel=0.01)
    fingers = xr.open_zarr(tmp_path / "out.zarr", group="run_1", consolidated=False)
    assert fingers.force.attrs["clock_error_s"] > 0.03  # after five minutes of what may be drift
    stamps = {path: path.stat().st_mtime_ns for path in (tmp_path / "out.zarr").rglob("zarr.json")}
    assert run("extract", runs, tmp_path / "out.zarr", "--workers", "1", "--quiet")[0] == 0
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in stamps.items())


def test_inspect_says_what_is_beside_and_draws_the_first_run(runs, tmp_path):
    found = afferents.inspect(runs, tmp_path / "look", quiet=True)
    assert found.problems == []
    (kept,) = [line for line in found.sentences if line.startswith("Kept alongside: ")]
    assert "force (force_x, force_y, force_z; N; 500 rows a second; in 1 of 1 recordings)" in kept
    assert "m, rad; 125 rows a second" in kept
    assert sum(line.startswith("No sensor is named") for line in found.sentences) == 1
    press = "run_0 is a press, not a recording: it sets the clock of force and pose."
    assert press in found.sentences
    assert [path.name for path in found.pictures] == ["markers.png", "responses.png"]


def test_a_clock_is_said_to_be_ahead_or_behind():
    ahead, behind = describe({"force": Lag(0.02), "pose": Lag(-0.005)}, "run_0")
    assert ahead.startswith("The clock of 'force' is 0.0200 s ahead of the images', by the press ")
    assert behind.startswith("The clock of 'pose' is 0.0050 s behind the images', by the press of ")


def test_sa1_of_streams_is_that_of_the_pins_from_rest(tmp_path):
    part = tmp_path / "train"
    arm_folders.write_streams(part, spacings=(2.0,), seconds=0.3)
    (found,) = afferents.extract(part, tmp_path / "out.zarr", workers=1, quiet=True)
    begin = round(arm_folders.STEADY_S * arm_folders.FPS)
    places = arm_folders.slide(Rig(), 2.0, 50.0, arm_folders.STEADY_S + 0.3)
    order = [
        int(np.argmin(np.linalg.norm(places[3] - rest, axis=1)))
        for rest in found.rest_position.values
    ]
    true = np.linalg.norm(places[begin:, order] - places[3, order], axis=2)
    assert sorted(order) == list(range(361))
    assert found.sizes["time"] == len(true)
    assert np.sqrt(np.mean((found.sa1.values - true) ** 2)) < 0.1
    assert true.mean() > 0.5  # pressed and sheared already where the stream begins


def a_press(time_s):
    """Depth of a press, and what the skin feels of it once it is touched."""
    depth = np.sin(np.pi * np.clip((time_s - 0.7) / 1.2, 0, 1)) ** 2
    return 10 * depth - 6, np.maximum(depth - 0.4, 0) ** 1.4


@settings(max_examples=25)
@given(
    lag_s=st.floats(-5000, 5000),
    fps=st.sampled_from([30, 60, 120]),
    noise=st.floats(0, 0.02),
    seed=st.integers(0, 99),
    sign=st.sampled_from([-1, 1]),
)
def test_any_lag_is_found_within_its_uncertainty_or_a_frame(lag_s, fps, noise, seed, sign):
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(2.6 * fps)) / fps
    felt = a_press(time_s)[1] + noise * rng.normal(size=len(time_s))
    other_s = np.arange(350) / 125 - 0.1
    found = measure_lag(time_s, felt, other_s + lag_s, sign * a_press(other_s)[0])
    assert abs(found.seconds - lag_s) <= max(found.error_s, 1 / fps)
    assert found.error_s < 1 / fps


@pytest.mark.parametrize("what", ["nothing pressed", "noise", "pressed twice alike"])
def test_what_does_not_tell_the_lag_is_refused(what):
    time_s = np.arange(540) / 90
    twice = a_press(time_s)[1] + a_press(time_s - 2.0)[1]
    felt = {
        "nothing pressed": np.zeros(540),
        "noise": np.random.default_rng(0).normal(size=540),
        "pressed twice alike": twice,
    }[what]
    z = a_press(time_s)[0] if what != "pressed twice alike" else twice
    other = slice(None) if what != "pressed twice alike" else slice(0, 250)
    with pytest.raises(InputError, match=r"expected one (whose z explains|lag of the clocks)"):
        measure_lag(time_s, felt, time_s[other], z[other])

"""Logs beside a recording are read as written; speed and force are series told from them."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st

from afferents.errors import InputError
from afferents.store import motion
from afferents.store.drum_path import DRIVE, MARK, Drum, logged_path
from afferents.store.log import LoggedFile, read_log, write_log

TIME = np.arange(0, 6, 0.008)


def swept(time_s):
    """The way, mm, and the speed, mm/s, of an arm that goes between 20 and 80 mm/s."""
    turn = 2 * np.pi / 4
    return 50 * time_s - 30 * np.sin(turn * time_s) / turn, 50 - 30 * np.cos(turn * time_s)


def logged(name, values, units, time_s=TIME, steady=(0.5, 5.5), length_s=6.0):
    """Responses of a recording with one log, and the log."""
    columns = tuple(f"{name}_{n}" for n in range(values.shape[1]))
    log = LoggedFile(name, Path(f"run_1/{name}.csv"), "timestamp", columns, units)
    variable = xr.DataArray(
        values.astype(np.float32),
        dims=(f"{name}_time", f"{name}_axis"),
        coords={f"{name}_time": time_s, f"{name}_axis": list(columns)},
    )
    frames = np.arange(0, length_s, 0.1)
    attrs = {"name": "run_1", "speed_mm_s": np.nan, "steady_s": json.dumps(steady)}
    return xr.Dataset({name: variable}, {"time": frames}, attrs), [log]


def pose(place_mm, scale=0.001):
    return np.stack([scale * place_mm, 0 * place_mm + 0.1, 0 * place_mm, *(0 * place_mm,) * 3], 1)


@pytest.mark.parametrize(("units", "scale"), [("m, rad", 0.001), ("mm, deg", 1.0)])
def test_speed_is_told_from_poses(units, scale):
    way, _ = swept(TIME)
    series = motion.speed_along(motion.add_motion(*logged("pose", pose(way, scale), units)))
    middle = (series.time_s > 0.2) & (series.time_s < 5.8)
    true = swept(series.time_s)[1]
    assert np.abs(series.values - true)[middle].max() < 0.4  # of 20 to 80: the filter's lag


def test_noise_of_poses_is_smoothed():
    way, _ = swept(TIME)
    noisy = way + np.random.default_rng(0).normal(0, 0.02, len(way))
    series = motion.speed_along(motion.add_motion(*logged("pose", pose(noisy), "m, rad")))
    error = (series.values - swept(series.time_s)[1])[30:-30]
    assert error.std() < 0.6  # a difference of neighbours would be off by 3.5
    assert np.std(np.diff(noisy) / 0.008 - swept(TIME[1:])[1]) > 3


def test_a_log_of_speeds_goes_before_poses_and_may_run_backwards():
    responses, logs = logged("speed", -swept(TIME)[1][:, None], "mm/s")
    kept = motion.add_motion(responses, logs)
    assert kept["speed"].dims == ("speed_time",)
    assert "speed_axis" not in kept.coords
    np.testing.assert_allclose(motion.speed_along(kept).values, swept(TIME)[1], rtol=1e-6)


@pytest.mark.parametrize(
    ("values", "units", "time_s", "found"),
    [
        (pose(swept(TIME)[0], 1.0), "m, rad", TIME, "a way of 299 m"),
        (pose(swept(TIME)[0]), "inch, rad", TIME, "found 'inch, rad'"),
        (np.where(TIME < 3.2, -1.0, 50.0)[:, None], "mm/s", TIME, "46% of them at 0 or below"),
        (pose(swept(TIME)[0]), "m, rad", TIME + 4000, "0.50 and 5.50 s .*, found 4000.00 to 4005"),
        (pose(swept(TIME[::200])[0]), "m, rad", TIME[::200], "5 rows or more .*, found 4"),
    ],
)
def test_what_is_no_slide_is_refused(values, units, time_s, found):
    name = "speed" if units == "mm/s" else "pose"
    with pytest.raises(InputError, match=f"run_1/{name}.csv: expected .*{found}"):
        motion.add_motion(*logged(name, values, units, time_s=time_s))


@pytest.mark.parametrize("sign", [1, -1])
def test_force_is_what_presses_and_a_sign_is_said(sign):
    values = np.stack([0 * TIME, 0.3 + 0 * TIME, sign * (2 + 0.5 * np.sin(TIME))], axis=1)
    kept = motion.add_motion(*logged("force", values, "N"))
    np.testing.assert_allclose(motion.force_along(kept).values, 2 + 0.5 * np.sin(TIME), rtol=1e-6)
    sentences = motion.force_sentences([kept.attrs["normal_force"]])
    assert len(sentences) == (sign < 0)
    assert not sentences or "force_2 is below 0" in sentences[0]


@given(
    st.lists(st.floats(0, 100, width=32), min_size=3, max_size=20),
    st.floats(0.01, 0.99), st.floats(0.01, 0.99),
)  # fmt: skip
def test_mean_and_extremes_over_a_part_are_those_of_fine_steps(values, one, other):
    series = motion.Series(np.linspace(0, 1, len(values)), np.array(values))
    start, stop = sorted((one, other))
    stop = max(stop, start + 0.005)
    mean, low, high = (part[0] for part in series.over(np.array([start]), np.array([stop])))
    fine = series.at(np.linspace(start, stop, 20_001))
    step = np.abs(np.diff(values)).max() * len(values) * (stop - start) / 20_000
    assert abs(mean - fine.mean()) <= step + 1e-6 + 1e-4 * max(values)
    assert low - 1e-9 <= fine.min() <= low + step + 1e-9
    assert high - step - 1e-9 <= fine.max() <= high + 1e-9


def test_beyond_its_ends_a_series_says_nothing():
    series = motion.Series(np.array([1.0, 2.0]), np.array([10.0, 20.0]))
    found = np.array(series.over(np.array([0.5, 1.2]), np.array([1.5, 1.8])))
    assert np.isnan(found[:, 0]).all()
    np.testing.assert_allclose(found[:, 1], [15, 12, 18])


def test_a_path_that_turns_has_the_speed_along_it():
    turn = 2 * np.pi * TIME / 3
    circle = 10 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    series = motion.differentiate(TIME, circle, "a circle")
    np.testing.assert_allclose(series.values[30:-30], 10 * 2 * np.pi / 3, rtol=0.01)


def test_empty_cells_of_a_log_hide_nothing_else():
    way, speed = swept(TIME)
    for name, values, along in (
        ("speed", speed[:, None], motion.speed_along),
        ("force", 2 + 0 * TIME[:, None], motion.force_along),
        ("pose", pose(way), motion.speed_along),
    ):
        values = values.copy()
        values[100:103] = np.nan
        units = {"speed": "mm/s", "force": "N", "pose": "m, rad"}[name]
        series = along(motion.add_motion(*logged(name, values, units)))
        mean, *_ = series.over(np.array([3.0]), np.array([4.0]))
        assert np.isfinite(mean).all(), name


COLUMNS = {"time_s": float, "number": int, "lost": bool}
ROWS = [(0.1 + 0.2, 7, True), (float("nan"), 8, False), (1e6 / 3, 2**53 + 1, False)]
DRUM = '{"circumference_mm": 250, "contact_mm": 2, "zero": "mark"}'
WAY = f"""# {{"origin_s": 10.0, "rows": 3, "drum": {DRUM}}}
time_s,position_mm,fault
10.5,1.0,
11.0,nan,"over, current"
11.5,3.0,
"""


def test_numbers_are_read_as_they_were_written(tmp_path):
    write_log(tmp_path / "x.csv", (*COLUMNS, "note"), [(*row, None) for row in ROWS], 1 / 3)
    head, table = read_log(tmp_path / "x.csv", COLUMNS)
    assert (head.origin_s, head.rows, head.drum) == (1 / 3, 3, None)
    assert list(table) == list(COLUMNS)
    np.testing.assert_allclose(table.time_s, [row[0] for row in ROWS], rtol=1e-15)  # pandas 2
    assert [*zip(table.number, table.lost, strict=True)] == [row[1:] for row in ROWS]


def test_where_there_is_no_log_there_is_none(tmp_path):
    assert read_log(tmp_path / "x.csv", COLUMNS) is None


def test_the_way_is_that_of_the_log(tmp_path):
    (tmp_path / DRIVE).write_text(WAY)
    way = logged_path(tmp_path)
    assert way.drum == Drum(circumference_mm=250, contact_mm=2, zero=MARK)
    np.testing.assert_array_equal([way.time_s, way.position_mm], [[0.5, 1.5], [1.0, 3.0]])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (WAY, "", "found a damaged file, no JSON"),
        (WAY, "PAR1", "found a damaged file, no JSON"),
        ('"rows": 3, ', "", "the key 'rows', found none"),
        ("10.0,", '"noon",', "origin_s: a valid number, found 'noon'"),
        ("250", "-250", "circumference_mm: greater than 0, found -250"),
        ("position_mm", "position", "found the columns time_s, position, fault"),
        ("3.0", "three", "could not convert string to float: 'three'"),
        ("nan", "", "could not convert string to float: ''"),
        ("3.0,\n", "", "could not convert string to float: ''"),
        ("11.5,3.0,\n", "", "found 2 of its 3 rows"),
        ("3.0,", "3.0,,,", "Expected 3 fields in line 4, saw 5"),
        (WAY.split("\n", 1)[1], "time_s,position_mm\n1,2,3\n" + 2 * "4,5,6\n", "rows longer than"),
        ("11.5", "9.5", "times that rise, found some that go back"),
    ],
)
def test_a_log_that_is_not_whole_is_refused(tmp_path, old, new, said):
    assert old in WAY
    (tmp_path / DRIVE).write_text(WAY.replace(old, new))
    with pytest.raises(InputError, match=said) as refused:
        logged_path(tmp_path)
    assert str(refused.value).startswith(str(tmp_path / DRIVE))
    assert "\n" not in str(refused.value)

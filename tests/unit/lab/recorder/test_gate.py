"""What a run is refused for: frames by their numbers, and the speed by what the drive answered."""

import math

import numpy as np
import pytest

from afferents.lab.recorder.gate import check_frames, check_speed, count_frames, unwrap_numbers
from afferents.lab.recorder.plan import RecordingPlan, Tolerance
from afferents.recordings.run_log import DriveRow, FrameRow, Log

PLAN = RecordingPlan(textures=["4"], speeds_mm_s=[60], camera={}, seconds=5.0)


def counted(numbers, times_s=None):
    """What became of frames of these numbers in 100 periods."""
    times_s = np.arange(len(numbers)) / 90 if times_s is None else times_s
    rows = [FrameRow(n, t, t, False, False, True) for n, t in zip(numbers, times_s, strict=True)]
    return count_frames(Log(0.0, rows), 90.0, 100 / 90)


@pytest.mark.parametrize("bits", [8, 16, 32])
def test_numbers_that_begin_again_at_0_are_neither_lost_nor_repeated(bits):
    numbers = [n % 2**bits for n in range(2**bits - 30, 2**bits + 70)]
    counts = counted(numbers)
    assert (counts.lost, counts.repeated) == ((), ())
    assert all(check.passes for check in check_frames(counts, Tolerance()))
    counts = counted(numbers[:20] + numbers[21:32] + numbers[33:])
    assert counts.lost == (2**bits - 10, 2**bits + 2)


def test_numbers_that_stand_or_fall_a_little_are_repeated():
    assert counted([0, 1, 2, 2, 3, 4]).repeated == (2,)
    assert counted([0, 1, 2, 3, 2, 4]).repeated == (2,)
    assert unwrap_numbers([]).size == 0


def test_a_number_that_leaps_makes_no_list_without_end():
    counts = counted([*range(50), *range(2**40, 2**40 + 50)])
    assert counts.lost == tuple(range(50, 151))  # one above all that can be
    assert not check_frames(counts, Tolerance())[0].passes


def speed_of(speeds, fault=None, plan=PLAN):
    """What a gate says of readings, 50 a second, from the start of the run."""
    steps = np.arange(len(speeds)) / 50 + PLAN.steady_s[0]
    rows = [DriveRow(t, math.nan, v, 60.0, None) for t, v in zip(steps, speeds, strict=True)]
    if fault:
        rows[-1] = rows[-1]._replace(fault=fault)
    return check_speed(Log(0.0, drive=rows), plan, 60.0)


def test_a_speed_passes_only_where_all_readings_or_none_know_it():
    assert speed_of([60.0] * 250).passes
    assert not speed_of([60.0] * 240 + [70.0] * 10).passes
    nothing = speed_of([math.nan] * 250)
    assert (nothing.passes, nothing.found) == (True, "unknown: nothing reads the drum")
    one = speed_of([60.0] + [math.nan] * 249)
    assert (one.passes, one.found) == (False, "known in 1 of 250 readings")
    assert speed_of([60.0] * 249 + [math.inf]).found == "known in 249 of 250 readings"
    assert speed_of([]).found == "known in 0 of 0 readings"


def test_a_sweep_need_not_hold_its_speed_but_must_move():
    plan = PLAN.model_copy(update={"speeds_mm_s": (40.0, 80.0), "sweep": True})
    swept = speed_of(list(np.linspace(40, 80, 250)), plan=plan)
    assert (swept.passes, swept.found) == (True, "60.00 mm/s on average, 40.00 to 80.00")
    assert not speed_of([0.1] * 250, plan=plan).passes
    assert not speed_of([200.0] * 250, plan=plan).passes


def test_a_fault_in_the_log_refuses_the_run():
    check = speed_of([math.nan] * 250, "impossible answer: its position is nan")
    assert not check.passes
    assert check.found == "the drive reports a fault: impossible answer: its position is nan"

"""Clocks that go apart: known drifts are found, late arrivals change little."""

import numpy as np
import pytest

from afferents.recorder.preflight import check_clocks, fit_drift
from afferents.recordings.run_log import Drift


@pytest.mark.parametrize("drift", [-300e-6, 0.0, 50e-6])
def test_a_known_drift_is_found_among_late_arrivals(drift):
    rng = np.random.default_rng(0)
    arrives = 1000 + np.arange(0, 1.5, 1 / 90)
    late = rng.exponential(0.002, len(arrives)) * (rng.random(len(arrives)) < 0.5)
    own = 7 + (arrives - arrives[0]) * (1 + drift)
    found = fit_drift(own, arrives + 0.003 + late)
    assert abs(found.share - drift) < 20e-6
    assert found.error < 20e-6


@pytest.mark.parametrize(
    ("ppm", "run_s", "passes"), [(40, 60, True), (150, 60, False), (150, 20, True)]
)
def test_sound_and_picture_may_go_half_a_frame_apart_in_a_run(ppm, run_s, passes):
    line = check_clocks(Drift(0.0, 0.0), Drift(ppm / 1e6, 0.0), 90.0, run_s)
    assert line.passes == passes
    assert f"microphone {ppm:+d} ppm" in line.found
    assert "runs shorter" in line.describe() or passes


def test_what_can_not_be_measured_is_no_fault():
    assert check_clocks(Drift(100e-6, 50e-6), None, 90.0, 60.0).passes

"""Runs and images as other speeds would give them: a known wave, gone through faster."""

import numpy as np
import pytest

from afferents.encodings.augment import faster_runs
from afferents.encodings.images import SpatialEncoding
from afferents.encodings.samples import concatenate, make_samples
from afferents.errors import InputError

N_FRAMES, SIDE = 10, 2


class Known:
    """Draws factors that a test knows."""

    def __init__(self, *factors):
        self.factors = list(factors)

    def uniform(self, low, high, n):
        factor = self.factors.pop(0)
        assert low <= factor <= high
        return np.full(n, factor)


def runs(frames, units, name="1/20"):
    """Runs of a recording whose every marker shows `frames`, one after the other."""
    values = np.repeat(frames, SIDE * SIDE).reshape(-1, N_FRAMES, SIDE, SIDE).astype(np.float32)
    start = np.arange(len(values)) / 9
    attrs = {"texture": "1", "speed_mm_s": 20.0, "name": name, "units": units}
    return make_samples(values, ("frame", "row", "column"), start, start + 1 / 9, attrs)


def wave(time):
    return np.sin(time / 4)


def test_a_run_is_gone_through_faster_and_slower():
    samples = runs(wave(np.arange(30)), "px")
    copies, origin = faster_runs(samples, np.array([1]), Known(0.5, 1.8))
    assert list(origin) == [0, 0]
    time = np.arange(N_FRAMES)
    np.testing.assert_allclose(copies[0, :, 0, 0], wave(10 + 0.5 * time), atol=0.01)
    np.testing.assert_allclose(copies[1, :, 1, 1], wave(10 + 1.8 * time), atol=0.01)


def test_ra1_is_larger_as_well():
    """It is what SA-I at that speed gives."""
    factor, time = 1.5, np.arange(N_FRAMES)
    slope = np.abs(np.diff(wave(np.arange(-1, 30))))
    copies, _ = faster_runs(runs(slope, "px/frame"), np.array([0]), Known(1.0, factor))
    faster = np.abs(wave(factor * time) - wave(factor * (time - 1)))
    np.testing.assert_allclose(copies[1, 1:, 0, 0], faster[1:], atol=0.04)
    np.testing.assert_allclose(copies[0, :, 0, 0], slope[:10], atol=1e-6)


def test_the_last_run_of_a_recording_is_never_sped_up():
    first, second = runs(np.arange(20.0), "px"), runs(100 + np.arange(20.0), "px", "1/40")
    samples = concatenate([first, second])
    copies, _ = faster_runs(samples, np.array([1, 2]), Known(0.75, 2.0))
    np.testing.assert_allclose(copies[2, :, 0, 0], 10 + np.arange(10))  # nothing follows it
    np.testing.assert_allclose(copies[3, :, 0, 0], 100 + 2 * np.arange(10))


def test_a_run_does_not_go_on_over_a_gap_nor_in_what_is_held_out():
    frames = np.concatenate([np.arange(10.0), np.full(10, 900.0), np.arange(20.0, 30)])
    samples = runs(frames, "px")
    gap = samples.isel(sample=[0, 2])  # the run between reached over the border of two arcs
    arcs = samples.assign_coords(group=("sample", ["1", "2", "2"]))
    for these in (gap, arcs):
        copies, _ = faster_runs(these, np.array([0]), Known(0.75, 1.8))
        np.testing.assert_allclose(copies[1, :, 0, 0], np.arange(10))
    copies, _ = faster_runs(arcs, np.array([1]), Known(0.75, 1.8))
    assert copies[1, -1, 0, 0] < 100  # the next run of the same arc is gone on in


def test_single_images_of_ra1_are_scaled_and_of_sa1_the_same():
    ra1 = runs(np.arange(20.0), "px/frame").isel(frame=0, drop=True)
    copies, origin = SpatialEncoding().stretched(ra1, np.array([0, 1]), Known(0.5, 2.0), "rebinned")
    np.testing.assert_allclose(copies[:, 0, 0], [0, 5, 0, 20])
    assert list(origin) == [0, 1, 0, 1]
    sa1 = ra1.assign_attrs(units="px")
    with pytest.raises(InputError, match="that change with the speed, found single images"):
        SpatialEncoding().stretched(sa1, np.array([0]), Known(0.5, 2.0), "rebinned")

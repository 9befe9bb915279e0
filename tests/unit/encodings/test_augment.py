"""Spectra, runs and images as other speeds would give them."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, strategies as st

from afferents.encodings.augment import faster_runs, stretch_spectrum, stretched_copies
from afferents.encodings.images import SpatialEncoding
from afferents.encodings.samples import concatenate, make_samples
from afferents.errors import InputError


def line(at: int, bins: int = 400) -> np.ndarray:
    spectrum = np.zeros(bins, dtype=np.float32)
    spectrum[at] = 1.0
    return spectrum


@pytest.mark.parametrize("kind", ["rebinned", "fourier"])
@given(at=st.integers(20, 180), factor=st.floats(0.5, 1.99))
def test_a_line_moves_to_its_stretched_frequency(kind, at, factor):
    assert abs(stretch_spectrum(line(at), factor, kind).argmax() - at * factor) <= 1.0


@given(
    st.lists(st.floats(0, 100, width=32), min_size=2, max_size=50),
    st.floats(0.25, 4.0),
)
def test_rebinned_neither_rings_nor_exceeds(values, factor):
    spectrum = np.array(values, dtype=np.float32)
    stretched = stretch_spectrum(spectrum, factor)
    assert stretched.min() >= -1e-3
    assert stretched.max() <= spectrum.max() * (1 + 1e-5) + 1e-3


def test_rebinning_halves_by_averaging_pairs_and_doubles_by_repeating():
    # Bin 1 at factor 1/2 covers old bins 1, 2 and 3, the outer ones by half.
    spectrum = np.array([0, 4, 8, 4, 0, 0, 0, 0], dtype=np.float32)
    np.testing.assert_allclose(stretch_spectrum(spectrum, 0.5)[:3], [4 / 3, 6, 1], atol=1e-5)
    # Bin 2 at factor 2 lies within old bin 1, bin 1 is half old bin 0, half old bin 1.
    np.testing.assert_allclose(stretch_spectrum(spectrum, 2.0)[:4], [0, 2, 4, 6], atol=1e-5)


def test_fourier_is_the_published_resampling():
    rng = np.random.default_rng(0)
    spectrum = rng.random(4000, dtype=np.float32)
    expected = scipy.signal.resample(spectrum, int(4000 * 0.613))[:200]
    np.testing.assert_allclose(
        stretch_spectrum(spectrum, 0.613, "fourier", 200), expected, atol=1e-6
    )


def test_what_lies_beyond_the_last_bin_is_zero():
    ones = np.ones(100, dtype=np.float32)
    np.testing.assert_allclose(stretch_spectrum(ones, 0.5)[51:], 0)
    assert stretch_spectrum(ones, 0.5, "fourier", 100)[50:].max() == 0


def test_six_copies_of_every_sample_carry_their_origin():
    spectra = np.stack([line(40)[None], line(80)[None]])
    copies, origin = stretched_copies(spectra, np.random.default_rng(0), "rebinned", 200)
    assert copies.shape == (12, 1, 200)
    np.testing.assert_array_equal(origin, [0, 1] * 6)
    factors = copies[:, 0].argmax(axis=1) / np.array([40, 80] * 6)
    assert (factors[:6] <= 1.02).all()
    assert (factors[6:] >= 0.98).all()
    assert factors.min() >= 0.48
    assert factors.max() <= 2.02


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan])
def test_a_factor_that_is_none_is_refused(factor):
    with pytest.raises(InputError, match="a stretch above 0"):
        stretch_spectrum(line(1), factor)


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

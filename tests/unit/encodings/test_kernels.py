"""Random kernels see one window at a time, neither its loudness nor masked lines."""

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.kernels import KernelEncoding
from afferents.encodings.spectra import Lines
from afferents.errors import InputError

RATE_HZ = 1000.0
HOW = KernelEncoding(window_s=1.0, stride_s=0.5, n_kernels=40)
MASK = Lines.parse("50Hz,0.1/mm")

compiles = pytest.mark.slow
"""On import the package compiles all it has, which takes most of a minute."""


def slide(seconds=3.0, tone_hz=31.0, loudness=1.0, hum=0.0, n_channels=1, name="w/1", seed=0):
    """A tone in noise, with lines of the mains and of a motor that turns at 0.1 per mm."""
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    shape = (len(time), n_channels)
    signal = np.sin(2 * np.pi * tone_hz * time)[:, None]
    signal = signal + np.random.default_rng(seed).normal(0, 0.3, shape)
    lines = np.sin(2 * np.pi * 50 * time + 1) + np.sin(2 * np.pi * 0.1 * 63.3 * time)
    return xr.DataArray(
        (loudness * signal + hum * lines[:, None]).astype(np.float32),
        dims=("audio_time", "channel"),
        attrs={"sample_rate_hz": RATE_HZ, "name": name, "texture": "w", "speed_mm_s": 63.3},
    )


def kernels(how=HOW, **changes):
    vibration = slide(**changes)
    return how.samples(vibration, slice(0, len(vibration)))


def largest_difference(some, others):
    """Of the highest values: of a few, the share steps by several percent where one crosses 0."""
    return np.abs(some.values - others.values)[:, ::2].max()


@compiles
def test_a_window_gives_two_features_a_kernel_wherever_it_is_encoded():
    vibration = slide()
    whole = HOW.samples(vibration, slice(0, 3000))
    later = HOW.samples(vibration, slice(1000, 3000))
    assert whole.shape == (5, 80)
    np.testing.assert_allclose(whole["start_s"], np.arange(5) * 0.5, atol=1e-3)
    np.testing.assert_allclose(whole["stop_s"] - whole["start_s"], 1.0, atol=1e-3)
    np.testing.assert_allclose(later["start_s"], whole["start_s"][2:], atol=1e-3)
    np.testing.assert_array_equal(later.values, whole.values[2:])


@compiles
def test_the_seed_gives_the_same_kernels_whatever_was_encoded_before():
    first = kernels()
    kernels(tone_hz=90.0, seconds=2.0, seed=1)
    np.testing.assert_array_equal(kernels(), first)
    other = kernels(HOW.model_copy(update={"seed": 1}))
    assert np.abs(other.values - first.values).max() > 1


@compiles
def test_tones_differ_and_loudness_does_not():
    plain, other = kernels(), kernels(tone_hz=60.0)
    assert largest_difference(kernels(loudness=30.0), plain) < 1e-4
    assert np.median(np.abs((other - plain).mean("sample")) / plain.std("sample")) > 3


@compiles
@pytest.mark.parametrize("hum", [0.5, 20.0])
def test_of_a_masked_line_nothing_is_left_however_loud(hum):
    masked = HOW.model_copy(update={"mask": MASK})
    assert largest_difference(kernels(masked, hum=hum), kernels(masked)) < 0.02
    assert largest_difference(kernels(hum=hum), kernels()) > 0.3


def test_too_short_a_recording_or_window_is_refused():
    with pytest.raises(InputError, match=r"w/1: expected at least one window of 1 s, found 0\.50"):
        kernels(seconds=0.5)
    with pytest.raises(InputError, match="windows of at least 11 values, found 10"):
        kernels(HOW.model_copy(update={"window_s": 0.01}))

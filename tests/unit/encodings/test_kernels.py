"""Random kernels see one window at a time, neither its loudness nor masked lines."""

import sys

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.kernels import KernelEncoding
from afferents.encodings.samples import concatenate
from afferents.encodings.settings import Encodings
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
def test_shares_are_of_all_values_and_highest_values_of_what_is_loud():
    values = kernels().values
    highest, share = values[:, ::2], values[:, 1::2]
    assert share.min() >= 0
    assert 50 < share.max() <= 100
    assert np.abs(highest).max() < 50


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


@compiles
def test_silence_and_a_line_alone_are_encoded_too():
    masked = HOW.model_copy(update={"mask": Lines(hertz=(50.0,))})
    time = np.arange(3000) / RATE_HZ
    alone = slide().copy(data=np.zeros((3000, 1), np.float32))
    silent = masked.samples(alone, slice(0, 3000))
    assert np.isfinite(silent.values).all()
    np.testing.assert_array_equal(silent.values, silent.values[[0] * len(silent)])
    alone.values[:, 0] = np.sin(2 * np.pi * 50 * time)
    hum = masked.samples(alone, slice(0, 3000))
    assert np.isfinite(hum.values).all()


@compiles
def test_channels_share_the_kernels_out():
    two = kernels(n_channels=2)
    assert two.shape == (5, 80)
    one = kernels(HOW.model_copy(update={"n_kernels": 20}))
    assert one.shape == (5, 40)


@compiles
def test_windows_of_unequal_length_are_refused():
    how = HOW.model_copy(update={"window_s": None})
    parts = [kernels(how, seconds=s, name=f"w/{s:g}") for s in (2.0, 3.0)]
    assert [len(part) for part in parts] == [1, 1]
    sentence = r"recording w/3: expected .* of a window of 2000 values.* found .* 3000 values"
    with pytest.raises(InputError, match=sentence):
        concatenate(parts)


def test_too_short_a_recording_or_window_is_refused():
    with pytest.raises(InputError, match=r"w/1: expected at least one window of 1 s, found 0\.50"):
        kernels(seconds=0.5)
    with pytest.raises(InputError, match="windows of at least 11 values, found 10"):
        kernels(HOW.model_copy(update={"window_s": 0.01}))


def test_a_missing_package_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyts.transformation", None)
    with pytest.raises(InputError, match=r"pip install 'afferents\[baselines\]'"):
        kernels()


def test_windows_are_those_of_orders():
    how = Encodings().changed(window_s=2.0, stride_s=0.25, mask=MASK)
    for name in ("window_s", "stride_s", "windows", "mask", "highest_hz"):
        assert getattr(how.of("kernels"), name) == getattr(how.of("orders"), name)
    assert how.of("kernels").n_kernels == 1000

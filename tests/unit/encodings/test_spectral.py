"""Spectra of windows: amplitudes, bins, and logarithms of anybody's windows."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st

from afferents import LogSpectra
from afferents.encodings.spectra import SpectralEncoding, amplitude_spectrum, spectral_samples
from afferents.errors import InputError


def vibration(signal: np.ndarray, rate: float) -> xr.DataArray:
    return xr.DataArray(
        np.asarray(signal, dtype=np.float32).reshape(len(signal), -1),
        dims=("audio_time", "channel"),
        attrs={
            "sample_rate_hz": rate,
            "name": "3/50",
            "texture": "3",
            "speed_mm_s": 50.0,
        },
        name="ra2",
    )


@given(st.integers(1, 199), st.floats(0.01, 10))
def test_a_sine_shows_its_amplitude_at_its_frequency(frequency, amplitude):
    time = np.arange(1000) / 1000
    spectrum = amplitude_spectrum(amplitude * np.sin(2 * np.pi * frequency * time))
    assert spectrum.argmax() == frequency
    assert spectrum[frequency] == pytest.approx(amplitude, rel=1e-4)


def test_a_minute_gives_119_windows_of_4000_bins():
    samples = spectral_samples(
        vibration(np.zeros(60 * 44100), 44100.0), slice(0, 60 * 44100), SpectralEncoding()
    )
    assert samples.sizes == {"sample": 119, "channel": 1, "frequency": 4000}
    np.testing.assert_array_equal(samples["frequency"][[0, 1, 3999]], [0, 1, 3999])
    np.testing.assert_array_equal(samples["start_s"][:3], [0, 0.5, 1.0])
    np.testing.assert_array_equal(samples["stop_s"][:3], [1.0, 1.5, 2.0])


def one(window_s: float, **changes) -> SpectralEncoding:
    return SpectralEncoding(window_s=window_s, stride_s=window_s, model_bins=10, **changes)


def test_slow_taxels_reach_nyquist_with_zero_padding():
    signal = np.random.default_rng(0).normal(size=(300, 16))
    encoding = one(128 * 0.028, fft_points=400, kept_bins=200, remove_mean=True)
    samples = spectral_samples(vibration(signal, 1 / 0.028), slice(0, 300), encoding)
    assert samples.sizes == {"sample": 2, "channel": 16, "frequency": 200}
    assert samples["frequency"].values[-1] == pytest.approx(199 / 400 / 0.028)


def test_the_mean_is_removed_window_by_window():
    signal = np.repeat([1.0, 5.0], 100)
    samples = spectral_samples(vibration(signal, 100.0), slice(0, 200), one(1.0, remove_mean=True))
    np.testing.assert_allclose(samples.values, 0, atol=1e-6)


@pytest.mark.parametrize(
    ("encoding", "part", "start_s"),
    [
        (one(1.0), slice(150, 400), [1.5, 2.5]),
        (SpectralEncoding(window_s=1.0, windows=3, model_bins=10), slice(0, 500), [0, 2.0, 4.0]),
    ],
)
def test_windows_start_after_the_cut_or_are_spread_from_end_to_end(encoding, part, start_s):
    samples = spectral_samples(vibration(np.arange(500), 100.0), part, encoding)
    np.testing.assert_array_equal(samples["start_s"], start_s)
    np.testing.assert_array_equal(samples["stop_s"] - samples["start_s"], 1)


@pytest.mark.parametrize(
    ("n", "encoding", "said"),
    [
        (90, one(1.0), r"3/50: expected at least one window of 1 s, found 0.90"),
        (180, one(1.0, fft_points=64), "at least the window's 100 samples, found 64"),
        (200, one(1.0).changed(model_bins=60), r"at most the 51 bins that .* has \(of 1 Hz\)"),
    ],
)
def test_what_makes_no_window_is_refused(n, encoding, said):
    with pytest.raises(InputError, match=said):
        spectral_samples(vibration(np.zeros(n), 100.0), slice(0, n), encoding)


def test_slowed_copies_have_all_bins_that_the_network_sees():
    assert SpectralEncoding().changed(model_bins=3000).kept_bins == 6000
    assert SpectralEncoding(kept_bins=200).changed().kept_bins == 200


@pytest.fixture
def windows():
    return np.random.default_rng(0).normal(size=(5, 64, 3)).astype(np.float32)


def test_a_tone_is_loudest_in_its_band_whatever_its_offset(windows):
    tone = np.sin(2 * np.pi * 20 * np.arange(64) / 100)[:, None]
    spectra = LogSpectra(100.0, 10.0, 40.0)
    found = spectra.fit_transform(0.01 * windows + tone).reshape(5, 3, 17)
    assert (found.argmax(axis=2) == 8).all()  # an octave above the first
    shifted = LogSpectra().transform(windows + 100)
    np.testing.assert_allclose(shifted, LogSpectra().transform(windows), atol=1e-2)


def test_what_is_too_short_or_has_other_axes_is_refused(windows):
    for model, short in ((LogSpectra(100.0, 1.0), windows), (LogSpectra(), windows[:, :2])):
        with pytest.raises(InputError, match=r"LogSpectra: .*take longer windows"):
            model.transform(short)
    with pytest.raises(InputError, match=r"\(n, time, channels\), found .*\(5, 64\); a single"):
        LogSpectra().transform(windows[:, :, 0])

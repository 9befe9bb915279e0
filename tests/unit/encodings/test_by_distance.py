"""Windows that are even in distance: a texture's lines stand still however the speed went."""

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.orders import OrderEncoding
from afferents.encodings.windows import add_distance, cut_by_distance, cut_windows
from afferents.errors import InputError
from afferents.store.motion import Series

RATE = 8000.0
TIME = np.arange(0, 8, 1 / RATE)
TURN = 2 * np.pi / 8
_AT = np.arange(0, 8.05, 0.01)
SWEEP = Series(_AT, 50 - 30 * np.cos(TURN * _AT))
WAY = 50 * TIME - 30 * np.sin(TURN * TIME) / TURN
ENCODING = OrderEncoding(window_s=4.0, stride_s=1.0)


def sound(signal):
    attrs = {"sample_rate_hz": RATE, "name": "run_1", "texture": "a", "speed_mm_s": np.nan}
    return xr.DataArray(signal[:, None], dims=("audio_time", "channel"), attrs=attrs)


def spectra(windows):
    values = windows.values[..., 0] * np.hanning(windows.values.shape[1])
    power = np.abs(np.fft.rfft(values, 4 * values.shape[1])) ** 2 / windows.rate_hz
    return np.arange(power.shape[1]) * windows.rate_hz / (4 * values.shape[1]), power


@pytest.mark.parametrize("per_mm", [0.5, 1.3])
def test_a_line_stands_at_cycles_per_mm_times_the_mean_speed(per_mm):
    swept = add_distance(sound(np.sin(2 * np.pi * per_mm * WAY)), SWEEP)
    windows = cut_by_distance(swept, slice(0, len(TIME)), ENCODING)
    hertz, power = spectra(windows)
    starts, stops = (np.interp(one, TIME, WAY) for one in (windows.start_s, windows.stop_s))
    mean = (stops - starts) / (windows.stop_s - windows.start_s)
    np.testing.assert_allclose(hertz[power.argmax(axis=1)], per_mm * mean, rtol=0.01)
    # and nearly all of it stands there, which without resampling it does not
    plain_hz, plain = spectra(cut_windows(swept, slice(0, len(TIME)), ENCODING))
    for axis, found, least, most in ((hertz, power, 0.98, 1.01), (plain_hz, plain, 0, 0.5)):
        near = np.abs(axis[None] - per_mm * mean[:, None]) < 1.0
        share = (found * near).sum(axis=1) / found.sum(axis=1)
        assert (share >= least).all()
        assert (share <= most).all()


def test_what_is_too_high_is_not_folded_back():
    swept = add_distance(sound(np.sin(2 * np.pi * 3100.0 * TIME)), SWEEP)
    windows = cut_by_distance(swept, slice(0, len(TIME)), ENCODING)
    hertz, power = spectra(windows)
    scale = 4.0**2 / 16 * windows.rate_hz  # of a line of amplitude 1
    assert (power[:, hertz < 200] / scale).max() < 1e-6


def test_a_constant_speed_changes_nothing():
    rng = np.random.default_rng(0)
    noise = sound(rng.normal(size=len(TIME)))
    steady = Series(np.array([0.0, 9.0]), np.array([40.0, 40.0]))
    plain = ENCODING.samples(noise.assign_attrs(speed_mm_s=40.0), slice(0, len(TIME)))
    told = add_distance(noise.assign_attrs(speed_mm_s=40.0), steady)
    found = ENCODING.samples(told, slice(0, len(TIME)))
    difference = np.abs(found.values - plain.values)
    assert np.median(difference) < 0.02  # in logarithms of power
    np.testing.assert_array_equal(found["start_s"], plain["start_s"])


def test_windows_beyond_the_log_are_left_out():
    short = Series(SWEEP.time_s[:600], SWEEP.values[:600])
    swept = add_distance(sound(np.sin(WAY)), short)
    windows = cut_by_distance(swept, slice(0, len(TIME)), ENCODING)
    assert (
        windows.stop_s.max() <= 6.0 < cut_windows(swept, slice(0, len(TIME)), ENCODING).stop_s[-1]
    )
    nothing = add_distance(sound(np.sin(WAY)), Series(TIME[:8000], 20 + 0 * TIME[:8000]))
    with pytest.raises(InputError, match="run_1: expected the speed of the slide while"):
        cut_by_distance(nothing, slice(0, len(TIME)), ENCODING)

"""Rates and intervals of known trains."""

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.spikes import (
    BINS,
    SpikeRateEncoding,
    SpikeTimingEncoding,
    interval_edges_s,
    interval_histograms,
)
from afferents.errors import InputError

ATTRS = {"name": "g/50", "texture": "g", "speed_mm_s": 50.0, "units": "spikes"}


def trains(intervals_s, seconds=3.0, rate_hz=2000):
    """Regular trains, a channel each."""
    counts = np.zeros((round(seconds * rate_hz), len(intervals_s)), np.float32)
    for channel, interval_s in enumerate(intervals_s):
        counts[:: round(interval_s * rate_hz), channel] = 1
    attrs = {**ATTRS, "sample_rate_hz": float(rate_hz)}
    return xr.DataArray(counts, dims=("audio_time", "channel"), attrs=attrs)


def test_rates_are_means_over_runs():
    counts = np.zeros((100, 3), np.float32)
    counts[:, 1] = 2
    counts[::5, 2] = 1
    response = xr.DataArray(counts, {"time": np.arange(100) / 90}, ("time", "marker"), attrs=ATTRS)
    samples = SpikeRateEncoding(rate_frames=20).samples(response, slice(0, 100), lookback=0)
    assert samples.dims == ("sample", "component", "marker")
    np.testing.assert_allclose(samples.values, np.tile([0, 2, 0.2], (5, 1, 1)), rtol=1e-6)
    with pytest.raises(InputError, match="at least 45 frames"):
        SpikeRateEncoding().samples(response, slice(0, 40), lookback=0)


def test_regular_trains_fill_one_bin():
    response = trains([0.005, 0.05, 0.1])
    samples = SpikeTimingEncoding().samples(response, slice(0, 6000))
    assert samples.shape == (5, 3, BINS)
    counts = np.expm1(samples.values)
    for channel, interval_s in enumerate([0.005, 0.05, 0.1]):
        (full,) = np.flatnonzero(counts[0, channel])
        edges = interval_edges_s()
        assert edges[full] <= interval_s < edges[full + 1]
        assert counts[0, channel, full] == pytest.approx(1 / interval_s - 1)


def test_extremes_count_for_the_outer_bins():
    train = np.zeros((8000, 1))
    train[[0, 1, 7000], 0] = 1  # intervals of 0.125 ms and 0.87 s at 8 kHz
    found = interval_histograms(train, 8000)[0]
    assert found[0] == found[-1] == 1
    assert found.sum() == 2
    assert not interval_histograms(np.zeros((10, 2)), 8000).any()

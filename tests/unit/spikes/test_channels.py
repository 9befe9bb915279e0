"""Spikes as channels: every spike is counted once, where it fell."""

import numpy as np
import pytest
import xarray as xr

from afferents.channels import CHANNELS
from afferents.spikes.artificial import artificial_spikes

FPS, RATE_HZ, SECONDS = 90, 4000, 3.0


@pytest.fixture
def recording():
    rng = np.random.default_rng(3)
    time = np.arange(round(SECONDS * FPS)) / FPS + 0.004
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    tone = (0.02 * np.sin(2 * np.pi * 70 * t)).astype(np.float32)[:, None]
    sa1 = rng.gamma(4, 0.5, (len(time), 5)).astype(np.float32)
    sa1[40:60, 2] = np.nan
    variables = {
        "sa1": (("time", "marker"), sa1, {"units": "px"}),
        "ra1": (("time", "marker"), np.abs(np.diff(sa1, axis=0, prepend=np.nan))),
        "ra2": (("audio_time", "channel"), tone, {"sample_rate_hz": float(RATE_HZ)}),
    }
    attrs = {"name": "g/50", "texture": "g", "speed_mm_s": 50.0, "steady_s": "null"}
    return xr.Dataset(variables, {"time": time}, attrs=attrs)


@pytest.mark.parametrize(("name", "n"), [("sa1_spikes", 5), ("ra1_spikes", 5), ("ra2_spikes", 8)])
def test_counts_hold_every_spike_of_their_class(recording, name, n):
    channel = CHANNELS[name]
    counts = channel.response(recording)
    assert counts.name == name
    assert counts.dims == recording[channel.made_of].dims
    assert counts.sizes[counts.dims[1]] == n
    assert counts.attrs["units"] == "spikes"
    edges = channel.edges(recording[channel.made_of])
    spikes = artificial_spikes(
        [recording[[channel.made_of]]],
        classes=[channel.afferent],
        start_s=edges[0],
        stop_s=edges[-1],
    )
    assert len(spikes.times) > 50
    np.testing.assert_array_equal(counts.sum(counts.dims[0]), spikes.counts()[0])
    for unit in range(n):
        when = spikes.train(0, unit) + edges[0]
        expected, _ = np.histogram(when, edges)
        np.testing.assert_array_equal(counts.values[:, unit], expected)


def test_lost_markers_are_silent_and_frames_keep_their_times(recording):
    counts = CHANNELS["sa1_spikes"].response(recording)
    assert not np.isnan(counts.values).any()
    assert counts.values[42:59, 2].sum() == 0
    np.testing.assert_array_equal(counts.time, recording.time)


@pytest.mark.parametrize("name", ["sa1_spikes", "ra1_spikes", "ra2_spikes"])
def test_no_model_of_them_is_given_raw_responses_live(name):
    assert not CHANNELS[name].felt_live

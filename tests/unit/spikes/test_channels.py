"""Spikes as channels: every spike is counted once, where it fell."""

import numpy as np
import pytest

from afferents.channels import CHANNELS
from afferents.spikes.artificial import artificial_spikes

from .conftest import recording_of

FPS, RATE_HZ, SECONDS = 90, 4000, 3.0


@pytest.fixture
def recording():
    rng = np.random.default_rng(3)
    time = np.arange(round(SECONDS * FPS)) / FPS + 0.004
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    tone = 0.02 * np.sin(2 * np.pi * 70 * t)
    sa1 = rng.gamma(4, 0.5, (len(time), 5))
    sa1[40:60, 2] = np.nan
    return recording_of(time, sa1, sound=tone, rate_hz=RATE_HZ)


@pytest.mark.parametrize(("name", "n"), [("sa1_spikes", 5), ("ra1_spikes", 5), ("ra2_spikes", 8)])
def test_counts_hold_every_spike_of_their_class(recording, name, n):
    channel = CHANNELS[name]
    counts = channel.response(recording)
    assert not channel.runs_live
    assert not np.isnan(counts.values).any()
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

"""Clocks of sound cards: when sound was taken, and how fast they go apart from this machine's."""

import json

import numpy as np
import pytest

from afferents.lab.devices import MicrophoneSettings
from afferents.lab.devices.base import Block
from afferents.lab.recorder.page import RecordingPage
from afferents.lab.recorder.watch import Watch
from afferents.markers.sensor import load_sensor
from afferents.recordings.run_log import BlockRow
from afferents.recordings.sound_clock import sound_clock

RATE_HZ, BLOCK = 44_100, 441
START_S = 1234.5


def blocks(seconds, drift=0.0, late=None, first_early_s=0.0):
    """Blocks of a sound card whose samples come faster than their rate by `drift`."""
    n = round(seconds * RATE_HZ / BLOCK)
    time_s = START_S + np.arange(n) * BLOCK / RATE_HZ * (1 - drift)
    time_s = time_s + (0 if late is None else late(n))
    time_s[0] -= first_early_s
    return [BlockRow(t, i * BLOCK, BLOCK, False) for i, t in enumerate(time_s.tolist())]


def heaps(n, seed):
    """How late a server stamps blocks that it hands on in heaps of six: by up to 60 ms."""
    rng = np.random.default_rng(seed)
    return rng.exponential(0.004, n) + np.where(rng.random(n) < 0.2, rng.uniform(0, 0.06, n), 0)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("drift", [-50e-6, 0.0, 50e-6])
def test_start_and_drift_are_found_among_blocks_that_are_late(drift, seed):
    taken = blocks(65, drift, lambda n: heaps(n, seed), first_early_s=0.14)
    clock = sound_clock(taken, RATE_HZ)
    usual_s = np.median(heaps(200_000, 99))  # what delays them all alike can't be told
    assert clock.start_s - usual_s == pytest.approx(START_S, abs=0.001)
    assert abs(clock.start_s - usual_s - START_S) < 5 * clock.error_s
    assert clock.drift.share == pytest.approx(drift, abs=15e-6)
    assert abs(clock.drift.share - drift) < 5 * clock.drift.error


def test_a_short_run_has_a_start_and_no_drift():
    clock = sound_clock(blocks(0.4, 50e-6, lambda n: heaps(n, 1), first_early_s=0.14), RATE_HZ)
    assert clock.start_s == pytest.approx(START_S, abs=0.006)
    assert clock.drift is None


def test_one_block_is_enough_and_what_follows_lost_samples_says_nothing():
    taken = blocks(20)
    assert sound_clock(taken[:1], RATE_HZ).start_s == START_S
    lost = [
        row._replace(time_s=row.time_s + 0.5 * (n >= 500), overflowed=n == 500)
        for n, row in enumerate(taken)
    ]
    assert sound_clock(lost, RATE_HZ).start_s == pytest.approx(START_S, abs=1e-6)


def test_the_page_shows_the_spectrum_of_a_sound_server():
    watch, samples = Watch(), np.ones((BLOCK, 1), np.int16)
    watch.microphone = MicrophoneSettings("a server's", RATE_HZ, 1)
    taken = blocks(2.9, late=lambda n: heaps(n, 0), first_early_s=0.14)
    watch.blocks.extend(Block(row.time_s, samples, False) for row in taken)
    state, _ = RecordingPage(watch, load_sensor("tip_b")).newest()
    assert "amplitude" in json.loads(state)["audio"]

"""A change of speed is a shift; phases between channels tell wavelengths; lines can be masked."""

import re

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

from afferents.encodings.orders import OrderEncoding
from afferents.encodings.windows import Lines, bridge
from afferents.errors import InputError

RATE_HZ = 1000.0
PER_MM = (0.2, 0.5, 0.9)
HOW = OrderEncoding(window_s=4.0, stride_s=4.0, bins_per_octave=12)


def slide(speed, seconds=4.0, apart_mm=(0.0,), hum_hz=None, rate=RATE_HZ):
    """A pattern of three wavelengths over taxels some way apart, and noise 60 dB below."""
    time = np.arange(round(seconds * rate)) / rate
    channels = [sum(np.sin(2 * np.pi * k * (speed * time - d)) for k in PER_MM) for d in apart_mm]
    signal = np.stack(channels, axis=1)
    signal += np.random.default_rng(0).normal(0, 1e-3, signal.shape)
    if hum_hz:
        signal += 0.001 * np.sin(2 * np.pi * hum_hz * time)[:, None]
    return xr.DataArray(
        signal.astype(np.float32),
        dims=("audio_time", "channel"),
        attrs={"sample_rate_hz": rate, "name": "w/1", "texture": "w", "speed_mm_s": speed},
    )


def orders(speed, how=HOW, **changes):
    vibration = slide(speed, **changes)
    return how.samples(vibration, slice(0, len(vibration)))


def test_a_tone_without_noise_leaves_numbers_everywhere():
    tone = slide(20.0).copy(data=1e6 * np.sin(np.arange(4000) / 4)[:, None].astype(np.float32))
    assert np.isfinite(HOW.samples(tone, slice(0, 4000)).values).all()


def lines_of(samples):
    """Return the frequencies of the three highest peaks."""
    power, frequency = samples.values[0, 0], samples["frequency"].values
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    return np.sort(frequency[peaks[np.argsort(power[peaks])[-3:]]])


@settings(deadline=None, max_examples=20)
@given(st.floats(15, 120))
def test_a_line_lies_at_its_cycles_per_mm_times_the_speed(speed):
    bin_width = 2 ** (1 / 12)
    found, true = lines_of(orders(speed)), np.array(PER_MM) * speed
    np.testing.assert_array_less(np.abs(np.log(found / true)), np.log(bin_width))


@settings(deadline=None, max_examples=20)
@given(st.floats(20, 100), st.floats(0.3, 0.9))
def test_phases_between_channels_tell_cycles_per_mm_whatever_the_speed(speed, apart_mm):
    samples = orders(speed, apart_mm=(0.0, apart_mm))
    assert samples.sizes["feature"] == 6
    for k in PER_MM:
        place = int(np.abs(np.log(samples["frequency"].values / (k * speed))).argmin())
        real, imaginary = samples.values[0, 2:4, place], samples.values[0, 4:6, place]
        # One is ahead of their mean, the other behind it.
        first, second = np.arctan2(imaginary, real)
        between = (2 * np.pi * k * apart_mm + np.pi) % (2 * np.pi) - np.pi
        assert first + second == pytest.approx(abs(between), abs=0.05)


def test_a_slide_the_other_way_has_the_same_orders():
    there = slide(40.0, apart_mm=(0.0, 0.4, 1.1))
    back = there.copy(data=there.values[::-1])
    features = (HOW.samples(one, slice(0, len(there))).values for one in (there, back))
    np.testing.assert_allclose(*features, atol=1e-3)


def test_a_masked_line_leaves_nothing_of_itself():
    mask = Lines.parse("50Hz")
    humming, quiet = (
        orders(30.0, how=HOW.model_copy(update={"mask": mask}), hum_hz=hum) for hum in (50.0, None)
    )
    np.testing.assert_allclose(humming.values, quiet.values, atol=1.0)
    assert np.abs(orders(30.0, hum_hz=50.0).values - quiet.values).max() > 1.5


def test_lines_that_follow_the_speed_are_masked_with_their_harmonics():
    frequency = np.linspace(0, 100, 1001)
    masked = Lines(per_mm=(0.1,)).masks(frequency, speed_mm_s=50.0, resolution_hz=0.2)
    assert masked[[50, 100, 150]].all()
    assert not masked[[0, 25, 75]].any()


def test_a_whole_recording_is_one_window():
    samples = orders(50.0, how=HOW.model_copy(update={"window_s": None}), seconds=7.3)
    assert samples.sizes["sample"] == 1
    assert float(samples["stop_s"][0]) == pytest.approx(7.3, abs=0.01)


def test_a_signal_sampled_finely_gives_the_same_orders():
    coarse, fine = orders(50.0), orders(50.0, rate=44100.0)
    audible = coarse.values[0, 0] > coarse.values[0, 0].max() - 5
    np.testing.assert_allclose(
        fine.values[0, 0][audible] - fine.values.max(),
        coarse.values[0, 0][audible] - coarse.values.max(),
        atol=0.3,
    )


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: orders(50.0, seconds=3.0), "w/1: expected at least one window of 4 s, found 3"),
        (lambda: orders(50.0, rate=5.0), "a sample rate for an octave above 2 Hz, found 5 Hz"),
        *(
            (lambda text=text: Lines.parse(text), "--mask: expected lines as in 50Hz,0.0573/mm")
            for text in ("50", "fifty Hz", "50Hz;100Hz", "0Hz", "-1/mm")
        ),
    ],
)
def test_what_has_no_orders_or_lines_is_refused(ask, said):
    with pytest.raises(InputError, match=re.escape(said)):
        ask()


def test_where_all_is_masked_nothing_is_left():
    frequency = np.linspace(1, 10, 10)
    loud, quiet = (np.full((1, 10), power) for power in (5.0, 0.1))
    everything = np.ones(10, dtype=bool)
    np.testing.assert_array_equal(
        bridge(loud, frequency, everything), bridge(quiet, frequency, everything)
    )

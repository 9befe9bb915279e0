"""Samples that are no numbers, beyond full scale, or clipped."""

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.quality.sound import find_overload, measure_clipping, require_finite
from afferents.recordings.audio import WavFile

RATE = 8000


@pytest.fixture
def noise():
    return np.random.default_rng(0).normal(0, 0.1, (RATE, 2)).astype(np.float32)


@pytest.mark.parametrize(
    ("value", "name"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf"), (1e300, "inf")]
)
def test_what_is_no_number_is_named_with_its_place(tmp_path, noise, value, name):
    samples = noise.astype(np.float64)
    samples[4000:4003, 1] = value
    soundfile.write(str(tmp_path / "a.wav"), samples, RATE, subtype="DOUBLE")
    with pytest.raises(InputError, match=rf"found {name} at sample 4000 \(0\.500 s\) and in 2 mor"):
        WavFile(tmp_path / "a.wav").read()
    assert WavFile(tmp_path / "a.wav", 0).read().sizes["audio_time"] == RATE  # the other channel


def test_places_count_from_the_first_sample_given():
    samples = np.array([[0.0, 1.0], [0.0, np.nan]])
    with pytest.raises(InputError, match=r"nan at sample 801 \(0\.100 s\);"):
        require_finite(samples, "a.wav", RATE, 800)


def test_beyond_full_scale_is_a_doubt_with_its_place(noise):
    noise[2000, 1] = -3
    (doubt,) = find_overload(noise[:, 1], "a.wav", RATE)
    assert doubt.kind == "loud"
    assert "found 1 beyond it, up to 3, first at sample 2000 (0.250 s)" in str(doubt)
    assert "--accept loud" in str(doubt.error)
    noise[0], noise[2000] = 1, -128 / 127  # full scale itself, and what conversion adds
    assert find_overload(noise, "a.wav", RATE) == []


@pytest.mark.parametrize("full", [1.0, 0.3, 12.0])
def test_a_clipped_signal_is_so_at_its_own_extremes(full):
    rng = np.random.default_rng(0)
    wave = 1.5 * np.sin(2 * np.pi * 50 * np.arange(RATE) / RATE) + rng.normal(0, 0.01, RATE)
    clipped = full * np.clip(wave, -1, 1)
    assert measure_clipping(clipped) == pytest.approx((np.abs(wave) >= 1).mean(), abs=0.02)
    assert measure_clipping(full * wave) == 0


def test_the_flat_top_of_a_slow_wave_and_silence_are_not_clipped():
    wave = np.rint(1000 * np.sin(2 * np.pi * 5 * np.arange(RATE) / RATE)) / 32768
    assert measure_clipping(wave) == measure_clipping(np.zeros(100)) == 0

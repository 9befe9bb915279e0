"""Distances between trains, against what can be worked out by hand; exponents of made noise."""

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.neuro.distances import DISTANCES, distance_matrix, found_by_nearest
from afferents.neuro.exponent import accuracy_by_exponent, exponents, spectral_exponent
from afferents.spikes import Spikes


def population(trains, duration_s=1.0):
    trials = {"texture": [str(i) for i in range(len(trains))], "duration_s": duration_s}
    return Spikes.from_trains([[t] for t in trains], {"name": ["a"], "class": ["PC"]}, trials)


def test_victor_purpura_counts_what_it_costs():
    """A spike moved by 4 ms costs 0.8 at a scale of 10 ms; one moved by 50 ms is cheaper anew."""
    spikes = population([[0.1, 0.5], [0.104, 0.5], [0.1], [0.1, 0.55]])
    found = distance_matrix(spikes, 0, time_s=0.01)
    np.testing.assert_allclose(found[0], [0, 0.8, 1, 2], atol=1e-9)
    rates = distance_matrix(spikes, 0, time_s=1e9)  # moving costs nothing: the rate alone
    np.testing.assert_allclose(rates[0], [0, 0, 1, 0], atol=1e-6)


def test_van_rossum_of_two_spikes_is_as_its_formula_says():
    spikes = population([[0.1], [0.105], [0.9]])
    found = distance_matrix(spikes, 0, "van-rossum", time_s=0.01)
    expected = np.sqrt(2 * (1 - np.exp(-0.5)))
    np.testing.assert_allclose(found[0, :2] / found[0, 2], [0, expected / np.sqrt(2)], atol=1e-3)


@pytest.mark.parametrize("name", DISTANCES)
def test_each_finds_trains_of_one_texture(name):
    rng = np.random.default_rng(0)
    of_texture = [np.arange(0.02, 1, step) for step in (0.05, 0.1, 0.2)]
    trains = [t + rng.normal(0, 1e-3, len(t)) for t in of_texture for _ in range(4)]
    found = distance_matrix(population(trains), 0, name)
    assert found_by_nearest(found, np.repeat(["a", "b", "c"], 4)) == 1


@pytest.mark.parametrize(
    ("spikes", "asked", "said"),
    [
        (population([[0.1], [0.2]]), {"distance": "hamming"}, "one of victor-purpura, van-rossum"),
        (population([[0.1], [0.2]]), {"time_s": 0}, "more than 0 s for victor-purpura, found 0"),
        (population([[0.1]]), {"distance": "van-rossum", "time_s": -1}, "more than 0 s .*found -1"),
        (population([[0.1], None]), {}, "unit a in every trial"),
        (population([[0.1], [0.2]], [1.0, 2.0]), {}, "trials of one length, found 1 to 2 s"),
    ],
)
def test_what_has_no_distance_is_refused(spikes, asked, said):
    with pytest.raises(InputError, match=said):
        distance_matrix(spikes, 0, **asked)


@pytest.mark.parametrize("exponent", [-2.0, -1.0, 0.0])
def test_exponents_of_made_noise(exponent):
    rng, n, rate_hz = np.random.default_rng(1), 60_000, 2000
    frequency = np.fft.rfftfreq(n, 1 / rate_hz)
    amplitude = np.where(frequency > 0, np.maximum(frequency, 1e-9) ** (exponent / 2), 0)
    waves = amplitude * np.exp(2j * np.pi * rng.uniform(size=len(frequency)))
    noise = np.fft.irfft(waves, n)
    assert spectral_exponent(noise, rate_hz) == pytest.approx(exponent, abs=0.1)
    assert spectral_exponent(100 * noise, rate_hz) == pytest.approx(exponent, abs=0.1)


def test_textures_of_different_exponents_are_recognised():
    rows = [(f"{t}/{v}", t, v, e + 0.01 * v / 40) for t, e in (("a", -1), ("b", -2), ("c", -3))
            for v in (40.0, 80.0)]  # fmt: skip
    table = pd.DataFrame(rows, columns=["recording", "texture", "speed_mm_s", "exponent"])
    assert accuracy_by_exponent(table) == {40.0: 1.0, 80.0: 1.0}
    assert exponents([]).empty

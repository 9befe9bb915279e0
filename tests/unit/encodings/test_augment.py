import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from afferents.encodings.augment import stretch_spectrum, stretched_copies
from afferents.errors import InputError


def line(at: int, bins: int = 400) -> np.ndarray:
    spectrum = np.zeros(bins, dtype=np.float32)
    spectrum[at] = 1.0
    return spectrum


@pytest.mark.parametrize("kind", ["rebinned", "fourier"])
@given(at=st.integers(20, 180), factor=st.floats(0.5, 1.99))
def test_a_line_moves_to_its_stretched_frequency(kind, at, factor):
    assert abs(stretch_spectrum(line(at), factor, kind).argmax() - at * factor) <= 1.0


@given(
    st.lists(st.floats(0, 100, width=32), min_size=2, max_size=50),
    st.floats(0.25, 4.0),
)
def test_rebinned_neither_rings_nor_exceeds(values, factor):
    spectrum = np.array(values, dtype=np.float32)
    stretched = stretch_spectrum(spectrum, factor)
    assert stretched.min() >= -1e-3
    assert stretched.max() <= spectrum.max() * (1 + 1e-5) + 1e-3


def test_rebinning_halves_by_averaging_pairs_and_doubles_by_repeating():
    # Bin 1 at factor 1/2 covers old bins 1, 2 and 3, the outer ones by half.
    spectrum = np.array([0, 4, 8, 4, 0, 0, 0, 0], dtype=np.float32)
    np.testing.assert_allclose(stretch_spectrum(spectrum, 0.5)[:3], [4 / 3, 6, 1], atol=1e-5)
    # Bin 2 at factor 2 lies within old bin 1, bin 1 is half old bin 0, half old bin 1.
    np.testing.assert_allclose(stretch_spectrum(spectrum, 2.0)[:4], [0, 2, 4, 6], atol=1e-5)


def test_fourier_is_the_published_resampling():
    rng = np.random.default_rng(0)
    spectrum = rng.random(4000, dtype=np.float32)
    expected = scipy.signal.resample(spectrum, int(4000 * 0.613))[:200]
    np.testing.assert_allclose(
        stretch_spectrum(spectrum, 0.613, "fourier", 200), expected, atol=1e-6
    )


def test_what_lies_beyond_the_last_bin_is_zero():
    ones = np.ones(100, dtype=np.float32)
    np.testing.assert_allclose(stretch_spectrum(ones, 0.5)[51:], 0)
    assert stretch_spectrum(ones, 0.5, "fourier", 100)[50:].max() == 0


def test_six_copies_of_every_sample_carry_their_origin():
    spectra = np.stack([line(40)[None], line(80)[None]])
    copies, origin = stretched_copies(spectra, np.random.default_rng(0), "rebinned", 200)
    assert copies.shape == (12, 1, 200)
    np.testing.assert_array_equal(origin, [0, 1] * 6)
    factors = copies[:, 0].argmax(axis=1) / np.array([40, 80] * 6)
    assert (factors[:6] <= 1.02).all()
    assert (factors[6:] >= 0.98).all()
    assert factors.min() >= 0.48
    assert factors.max() <= 2.02


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan])
def test_a_factor_that_is_none_is_refused(factor):
    with pytest.raises(InputError, match="a stretch above 0"):
        stretch_spectrum(line(1), factor)

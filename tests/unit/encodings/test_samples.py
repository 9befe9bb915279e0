"""Samples of several recordings: what is kept when they are joined, and what can't be."""

import numpy as np
import pytest

from afferents.encodings.samples import Samples, concatenate, list_textures, make_samples
from afferents.errors import InputError


def spectra(texture: str, units: str | None = "counts", spacing_hz: float = 1.0) -> Samples:
    attrs = {"texture": texture, "speed_mm_s": 10, "name": f"{texture}/10"}
    return make_samples(
        np.zeros((2, 1, 5), np.float32),
        ("channel", "frequency"),
        np.array([0.0, 0.5]),
        np.array([1.0, 1.5]),
        {**attrs, "units": units} if units else attrs,
        {"frequency": spacing_hz * np.arange(5)},
    )


def test_units_come_from_the_response_and_survive_joining():
    assert spectra("1").attrs == {"units": "counts"}
    assert concatenate([spectra("1"), spectra("2")]).attrs == {"units": "counts"}
    assert concatenate([spectra("1"), spectra("2", "full scale")]).attrs == {}


def test_bins_of_other_frequencies_or_numbers_are_refused():
    with pytest.raises(InputError, match=r"recording 2/10: .*5 frequency up to 4.0 Hz.*8.0 Hz"):
        concatenate([spectra("1"), spectra("2", spacing_hz=2.0)])
    with pytest.raises(InputError, match=r"recording 2/10: .*1 channel x 5 .*found 1 channel x 4 "):
        concatenate([spectra("1"), spectra("2").isel(frequency=slice(0, 4))])


def test_textures_are_in_natural_order():
    joined = concatenate([spectra(texture) for texture in ("linen", "10", "2")])
    assert list_textures(joined) == ["2", "10", "linen"]

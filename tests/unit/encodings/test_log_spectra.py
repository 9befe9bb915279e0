"""Log spectra of anybody's windows."""

import numpy as np
import pytest

from afferents import LogSpectra
from afferents.errors import InputError


@pytest.fixture
def windows():
    return np.random.default_rng(0).normal(size=(5, 64, 3)).astype(np.float32)


def test_a_tone_is_loudest_in_its_band_whatever_its_offset(windows):
    tone = np.sin(2 * np.pi * 20 * np.arange(64) / 100)[:, None]
    spectra = LogSpectra(100.0, 10.0, 40.0)
    found = spectra.fit_transform(0.01 * windows + tone).reshape(5, 3, 17)
    assert (found.argmax(axis=2) == 8).all()  # an octave above the first
    shifted = LogSpectra().transform(windows + 100)
    np.testing.assert_allclose(shifted, LogSpectra().transform(windows), atol=1e-2)


def test_what_is_too_short_or_has_other_axes_is_refused(windows):
    for model, short in ((LogSpectra(100.0, 1.0), windows), (LogSpectra(), windows[:, :2])):
        with pytest.raises(InputError, match=r"LogSpectra: .*take longer windows"):
            model.transform(short)
    with pytest.raises(InputError, match=r"\(n, time, channels\), found .*\(5, 64\); a single"):
        LogSpectra().transform(windows[:, :, 0])

"""How like an image is to a later one: known images in, known correlations out."""

import numpy as np
import pytest
import xarray as xr

from afferents.inspection.stores import measure_steadiness, steadiness


def test_what_stays_the_same_is_one_and_what_turns_round_is_minus_one():
    rng = np.random.default_rng(0)
    image = rng.normal(size=361)
    scaled = np.outer(np.linspace(1, 5, 60), image) + 3.0  # the same pattern, ever stronger
    assert steadiness(scaled, 20) == pytest.approx(1)
    turned = np.where(np.arange(60)[:, None] // 20 % 2, image, -image)
    assert steadiness(turned, 20) == pytest.approx(-1)
    for none in (np.zeros((20, 9)), np.full((40, 9), np.nan)):  # too few frames, and no marker
        assert np.isnan(steadiness(none, 20))


def test_a_pattern_with_noise_has_the_share_of_its_variance():
    rng = np.random.default_rng(1)
    pattern = rng.normal(size=361)
    noisy = 2 * pattern + rng.normal(size=(200, 361))
    share = 4 * pattern.var() / (4 * pattern.var() + 1)
    assert steadiness(noisy, 20) == pytest.approx(share, abs=0.01)
    assert steadiness(rng.normal(size=(200, 361)), 20) == pytest.approx(0, abs=0.02)


def test_lost_markers_are_left_out_of_both_images():
    rng = np.random.default_rng(2)
    images = np.tile(rng.normal(size=50), (40, 1))
    images[:10, 3] = np.nan
    images[25:, 7] = np.nan
    assert steadiness(images, 20) == pytest.approx(1)


def test_recordings_with_markers_have_a_row():
    rng = np.random.default_rng(3)
    still = np.tile(rng.normal(size=30), (50, 1))
    attributes = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0}
    dims = ("time", "marker")
    felt = xr.Dataset({"sa1": (dims, still), "ra1": (dims, rng.normal(size=(50, 30)))})
    heard = xr.Dataset({"ra2": ("audio_time", np.zeros(9))}, attrs=attributes)
    (row,) = measure_steadiness([felt.assign_attrs(attributes), heard])
    assert row["recording"] == "3/50"
    assert row["speed_mm_s"] == 50
    assert row["sa1"] == pytest.approx(1)
    assert row["ra1"] < 0.2

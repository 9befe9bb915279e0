"""Variances of displacement fields whose parts are known."""

import numpy as np
import pytest

from afferents.reporting.shear import moving, plane_basis, variance_shares

REST = np.stack([i.ravel() for i in np.indices((9, 9))], axis=1).astype(float)
BASIS = plane_basis(REST)
GROWTH = REST - REST.mean(axis=0)
RIPPLE = np.stack([np.where(REST.sum(axis=1) % 2, 1.0, -1.0), np.zeros(81)], axis=1)
RIPPLE -= BASIS @ (BASIS.T @ RIPPLE)


def field(shift=0.0, growth=0.0, ripple=0.0):
    return np.array([shift, 0.0]) + growth * GROWTH + ripple * RIPPLE


def power(pattern):
    return (pattern**2).sum(axis=1).mean()


def test_over_time_each_part_has_its_variance():
    frames = np.stack([field(2 * s, 0.1 * g, r) for s in (-1, 1) for g in (-1, 1) for r in (-1, 1)])
    found = moving(frames, BASIS)
    np.testing.assert_allclose(found.mean, 0, atol=1e-12)
    expected = (4.0, 0.01 * power(GROWTH), power(RIPPLE))
    np.testing.assert_allclose(found.over_time, expected)
    assert found.over_time.total == pytest.approx(sum(expected))
    assert found.over_time.shear == pytest.approx(1 - power(RIPPLE) / sum(expected))


def test_textures_that_differ_in_shift_and_speeds_that_differ_in_ripple():
    still = {
        (texture, speed): [moving(np.stack([field(shift, ripple=speed)] * 2), BASIS)] * 2
        for texture, shift in (("a", 1.0), ("b", 3.0))
        for speed in (1.0, 2.0)
    }
    found = variance_shares(still, BASIS)
    np.testing.assert_allclose(found["between textures"], (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(found["between speeds"], (0, 0, 0.25 * power(RIPPLE)), atol=1e-12)
    np.testing.assert_allclose(found["over time"], 0, atol=1e-12)
    assert np.isnan(found["over time"].shear) or found["over time"].total < 1e-12

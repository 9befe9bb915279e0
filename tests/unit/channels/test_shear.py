"""The global shear of known displacements, on any layout, and what is left of them."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

from afferents.channels import CHANNELS, PARTS
from afferents.filling import hold

SQUARE = np.stack([i.ravel() for i in np.indices((19, 19))], axis=1) * 22.0 + [120, 40]
ANGLE = np.arange(60) * 2.4
SPIRAL = 25 * np.sqrt(np.arange(60.0))[:, None] * np.stack([np.cos(ANGLE), np.sin(ANGLE)], axis=1)
NUMBERS = st.floats(-0.1, 0.1)


def recording(rest, moved):
    """One frame at rest, then each of `moved` (frame, marker, space)."""
    places = np.concatenate([rest[None], rest + moved])
    return xr.Dataset(
        {
            "position": (("time", "marker", "space"), places),
            "rest_position": (("marker", "space"), rest),
        },
        {"time": np.arange(len(places)) / 90},
    )


def planes(rest, shift, gradient):
    """Displacement (1, marker, space) with `gradient` [[du/dx, du/dy], [dv/dx, dv/dy]]."""
    return (np.asarray(shift) + (rest - rest.mean(axis=0)) @ np.asarray(gradient).T)[None]


def shear_of(found):
    return CHANNELS["shear"].response(found)


@settings(deadline=None, max_examples=30)
@given(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), st.tuples(*[NUMBERS] * 4))
@pytest.mark.parametrize("rest", [SQUARE, SPIRAL], ids=["square", "spiral"])
def test_a_plane_is_found_whole(rest, shift, gradient):
    a, b, c, d = gradient
    found = recording(rest, planes(rest, shift, [[a, b], [c, d]]))
    shear = shear_of(found)
    assert list(shear["shear"].values) == list(PARTS)
    half = shear.attrs["radius_px"] / 2
    expected = [*shift, half * (a + d), half * (c - b), half * (a - d), half * (b + c)]
    np.testing.assert_allclose(shear[1], expected, atol=1e-9)
    np.testing.assert_allclose(shear[0], 0, atol=1e-12)
    np.testing.assert_allclose(CHANNELS["sa1_local"].response(found), 0, atol=1e-9)


def test_each_part_is_the_displacement_that_it_causes():
    """Root mean square, in px."""
    for gradient, part in (
        ([[0.01, 0], [0, 0.01]], "divergence"),
        ([[0, -0.01], [0.01, 0]], "curl"),
        ([[0.01, 0], [0, -0.01]], "stretch"),
        ([[0, 0.01], [0.01, 0]], "shear"),
    ):
        moved = planes(SQUARE, [0, 0], gradient)
        shear = shear_of(recording(SQUARE, moved)).sel(shear=part)[1]
        rms = np.sqrt((moved**2).sum(axis=2).mean())
        np.testing.assert_allclose(shear, rms, rtol=1e-9)


def test_lost_markers_change_nothing_of_a_plane():
    moved = planes(SQUARE, [3, -1], [[0.02, 0.01], [0, -0.03]])
    gone = recording(SQUARE, moved)
    gone.position[1, :200] = np.nan
    np.testing.assert_allclose(shear_of(gone)[1], shear_of(recording(SQUARE, moved))[1], atol=1e-9)
    local = CHANNELS["sa1_local"].response(gone)
    assert np.isnan(local[1, :200]).all()
    np.testing.assert_allclose(local[1, 200:], 0, atol=1e-9)


@pytest.mark.parametrize("left", [slice(0, 2), slice(0, 19), slice(0, 0)], ids=["two", "line", "0"])
def test_too_few_markers_have_no_shear_and_the_last_is_held(left):
    found = recording(SQUARE, np.repeat(planes(SQUARE, [3, -1], np.zeros((2, 2))), 2, axis=0))
    seen = found.position.values[2, left].copy()
    found.position[2] = np.nan
    found.position[2, left] = seen
    shear = shear_of(found)
    assert np.isnan(shear[2]).all()
    np.testing.assert_allclose(hold(shear)[2], [3, -1, 0, 0, 0, 0], atol=1e-9)


def test_what_is_left_has_no_shear_and_adds_up():
    rng = np.random.default_rng(0)
    found = recording(SQUARE, rng.normal(size=(4, 361, 2)))
    local = CHANNELS["sa1_local"].response(found)
    left = found.assign(position=found.rest_position + local)
    np.testing.assert_allclose(shear_of(left), 0, atol=1e-12)
    whole = CHANNELS["sa1_vector"].response(found)
    power = (whole**2).sum("space").mean("marker") - (local**2).sum("space").mean("marker")
    np.testing.assert_allclose((shear_of(found) ** 2).sum("shear"), power)

"""The directions that SA-I and RA-I leave out, by hand."""

import numpy as np
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from afferents.channels import ra1, ra1_circumferential, ra1_signed, sa1, sa1_vector


def path(places):
    values = np.asarray(places, dtype=np.float64)[:, None, :]
    return xr.DataArray(values, dims=("time", "marker", "space"), coords={"space": ["x", "y"]})


REST = xr.DataArray([[0.0, 0.0]], dims=("marker", "space"), coords={"space": ["x", "y"]})


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=2, max_size=6))
def test_their_lengths_are_sa1_and_ra1(places):
    position = path(places)
    length = (sa1_vector(position, REST) ** 2).sum("space") ** 0.5
    np.testing.assert_allclose(length, sa1(position, REST), atol=1e-12)
    signed = ra1_signed(sa1(position, REST))
    np.testing.assert_allclose(abs(signed), ra1(sa1(position, REST)), equal_nan=True)


def test_a_circle_is_felt_by_the_part_that_goes_round_alone():
    angle = np.arange(5) * 0.1
    circle = path(np.stack([3 * np.cos(angle), 3 * np.sin(angle)], axis=1))
    around = ra1_circumferential(sa1_vector(circle, REST))
    np.testing.assert_allclose(ra1(sa1(circle, REST))[1:], 0, atol=1e-12)
    np.testing.assert_allclose(around[1:], 3 * np.sin(0.1))
    assert np.isnan(around[0]).all()

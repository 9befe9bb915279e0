"""The same wave gives the same powers however fast it slides, wherever it is, however strong."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

from afferents.encodings.wavenumbers import WavenumberEncoding, unseen_waves
from afferents.errors import InputError

from .conftest import respond

HOW = WavenumberEncoding(frames=20)


def response(step, wavenumber=0.25, size=1.0, n_frames=40, start=0.0):
    """A wave along the columns of a 19 x 19 grid that moves `step` markers a frame."""
    row, column = (i.ravel() for i in np.indices((19, 19)))
    frame = np.arange(n_frames)[:, None]
    values = size * np.cos(2 * np.pi * wavenumber * (column - step * frame - start))
    return respond(values, row, column)


def waves(response, memory=1, how=HOW, frames=None):
    return how.samples(response, frames or slice(0, response.sizes["time"]), memory)


def test_a_wave_shows_at_its_wavenumber():
    samples = waves(response(0.3, wavenumber=0.25))
    assert samples.dims == ("sample", "component", "row_wavenumber", "column_wavenumber")
    highest = np.unravel_index(samples.values[0].argmax(), samples.shape[1:])
    assert float(samples["row_wavenumber"][highest[1]]) == 0
    assert float(samples["column_wavenumber"][highest[2]]) == pytest.approx(0.25, abs=0.5 / 19)


@settings(deadline=None, max_examples=30)
@given(st.floats(0, 3), st.floats(0, 4), st.floats(0.5, 20))
def test_neither_speed_nor_place_nor_strength_matters(step, start, size):
    one, other = waves(response(0.7)), waves(response(step, start=start, size=size))
    strong = one.values > one.values.max() - 4
    difference = (one.values - other.values)[strong]
    np.testing.assert_allclose(difference, difference.mean(), atol=0.5)


def test_what_stands_still_is_taken_out_of_sa1():
    moving = response(0.3)
    on_a_pull = moving + 30 * np.cos(2 * np.pi * 0.1 * moving["column"])
    np.testing.assert_allclose(
        waves(on_a_pull.assign_attrs(moving.attrs), memory=0), waves(moving, memory=0), atol=1e-2
    )


def test_runs_follow_one_another_and_a_vector_has_two_components():
    samples = waves(response(0.3, n_frames=50), frames=slice(5, 48))
    np.testing.assert_allclose(samples["start_s"], np.array([4, 24]) / 90)  # RA-I looks one back
    np.testing.assert_allclose(samples["stop_s"], np.array([25, 45]) / 90)
    with pytest.raises(InputError, match="at least 20 frames after the cut, found 12"):
        waves(response(0.3, n_frames=12))
    along, across = response(0.3), response(0.1)
    vector = xr.concat([along, across], dim="space").transpose("time", "marker", "space")
    assert waves(vector.assign_attrs(along.attrs)).sizes["component"] == 2


def test_textures_finer_than_two_pins_are_named_and_smooth_or_worded_ones_are_not():
    said = unseen_waves(1.2, ["0", "0.5", "2", "2.4", "3", "felt"])
    assert said == (
        "Models of waves cannot resolve waves shorter than twice the distance of the pins, 2.4 mm "
        "(here the bumps of 0.5, 2)."
    )
    assert unseen_waves(1.2, ["3", "felt"]).endswith("2.4 mm.")

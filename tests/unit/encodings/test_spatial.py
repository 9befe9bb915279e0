"""Frames and runs of frames as samples."""

import numpy as np
import pytest

from afferents.encodings.images import component_images, spatial_samples, spatiotemporal_samples
from afferents.errors import InputError

from .conftest import respond

ROW, COLUMN = [1, 0, 1, 0, 1, 0], [2, 1, 0, 2, 1, 0]
"""Six markers in two rows of three, listed out of order; value = 100 frame + marker."""
RESPONSE = respond(100.0 * np.arange(25)[:, None] + np.arange(6), ROW, COLUMN)


def test_a_frame_is_a_sample_with_its_extent():
    samples = spatial_samples(RESPONSE, slice(22, 25), memory=0)
    assert samples.dims == ("sample", "row", "column")
    np.testing.assert_array_equal(samples[0] - 2200, [[5, 1, 3], [2, 4, 0]])
    np.testing.assert_array_equal(samples.values[:, 0, 0], [2205, 2305, 2405])
    np.testing.assert_allclose(samples["start_s"] * 90, [22, 23, 24])
    np.testing.assert_allclose(samples["stop_s"] * 90, [23, 24, 25])
    of_ra1 = spatial_samples(RESPONSE, slice(5, 8), memory=1)
    np.testing.assert_allclose(of_ra1["start_s"] * 90, [4, 5, 6])


def test_windows_are_ten_frames_and_do_not_overlap():
    samples = spatiotemporal_samples(RESPONSE, slice(2, 25), memory=0)
    assert samples.sizes == {"sample": 2, "frame": 10, "row": 2, "column": 3}
    np.testing.assert_array_equal(samples.values[1, :, 0, 0], 100 * np.arange(12, 22) + 5)
    np.testing.assert_allclose(samples["start_s"] * 90, [2, 12])
    np.testing.assert_allclose(samples["stop_s"] * 90, [12, 22])


def test_what_makes_no_image_or_window_is_refused():
    with pytest.raises(InputError, match=r"sa1 of 3/50: expected markers whose places are known"):
        component_images(RESPONSE.drop_vars("row"))
    with pytest.raises(InputError, match="lost markers filled"):
        component_images(RESPONSE.where(RESPONSE != 3))
    with pytest.raises(InputError, match=r"at least 10 frames .* found 9"):
        spatiotemporal_samples(RESPONSE, slice(0, 9), memory=0)

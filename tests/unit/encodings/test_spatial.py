import numpy as np
import pytest
import xarray as xr

from afferents.encodings.images import component_images, spatial_samples, spatiotemporal_samples
from afferents.errors import InputError

ATTRS = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0}


def response(n_frames: int = 25, grid: bool = True) -> xr.DataArray:
    """Six markers in two rows of three, listed out of order; value = 100 frame + marker."""
    values = 100.0 * np.arange(n_frames)[:, None] + np.arange(6)
    place = {"row": ("marker", [1, 0, 1, 0, 1, 0]), "column": ("marker", [2, 1, 0, 2, 1, 0])}
    return xr.DataArray(
        values.astype(np.float32),
        dims=("time", "marker"),
        coords={"time": np.arange(n_frames) * 0.5, **(place if grid else {})},
        attrs=ATTRS,
        name="sa1",
    )


def test_a_frame_is_a_sample_with_its_extent():
    samples = spatial_samples(response(), slice(22, 25), memory=0)
    assert samples.dims == ("sample", "row", "column")
    np.testing.assert_array_equal(samples[0] - 2200, [[5, 1, 3], [2, 4, 0]])
    np.testing.assert_array_equal(samples.values[:, 0, 0], [2205, 2305, 2405])
    np.testing.assert_array_equal(samples["start_s"], [11.0, 11.5, 12.0])
    np.testing.assert_array_equal(samples["stop_s"], [11.5, 12.0, 12.5])
    of_ra1 = spatial_samples(response(), slice(5, 8), memory=1)
    np.testing.assert_array_equal(of_ra1["start_s"], [2.0, 2.5, 3.0])


def test_windows_are_ten_frames_and_do_not_overlap():
    samples = spatiotemporal_samples(response(), slice(2, 25), memory=0)
    assert samples.sizes == {"sample": 2, "frame": 10, "row": 2, "column": 3}
    np.testing.assert_array_equal(samples.values[1, :, 0, 0], 100 * np.arange(12, 22) + 5)
    np.testing.assert_array_equal(samples["start_s"], [1.0, 6.0])
    np.testing.assert_array_equal(samples["stop_s"], [6.0, 11.0])


def test_what_makes_no_image_or_window_is_refused():
    with pytest.raises(InputError, match=r"sa1 of 3/50: expected markers whose places are known"):
        component_images(response(grid=False))
    with pytest.raises(InputError, match="lost markers filled"):
        component_images(response().where(response() != 3))
    with pytest.raises(InputError, match=r"at least 10 frames .* found 9"):
        spatiotemporal_samples(response(), slice(0, 9), memory=0)

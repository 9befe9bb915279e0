"""Spatial encoding: one tactile image a frame (paper, section 2.2.1)."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.samples import Samples, make_samples
from afferents.encodings.augment import Stretch
from afferents.encodings.base import Floats, ImageEncoding
from afferents.encodings.faster import RANGES, faster_images
from afferents.encodings.tactile_image import tactile_images


class SpatialEncoding(ImageEncoding):
    """Every frame is a sample, a tactile image (row, column); it has no options."""

    name, sample_dims = "spatial", (dims.ROW, dims.COLUMN)

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, row, column)`; see `spatial_samples`."""
        return spatial_samples(response, kept, lookback)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs of one."""
        return runs[:, 0, 0]

    @property
    def n_copies(self) -> int:
        """How many copies of a sample are made."""
        return len(RANGES)

    def stretched(
        self,
        samples: Samples,
        index: NDArray[np.int64],
        rng: np.random.Generator,
        stretch: Stretch,
    ) -> tuple[Floats, NDArray[np.int64]]:
        """Return two copies of RA-I images as other speeds would give them; see `faster_images`."""
        return faster_images(samples, index, rng)

    def stream(self, lookback: int) -> "OneByOne":
        """Return what takes an image for a sample."""
        return OneByOne()


class OneByOne:
    """Images as they come are samples."""

    def skip(self) -> None:
        """Have nothing to forget."""

    def feed(self, image: Floats) -> Floats:
        """Return the image."""
        return image


def frame_extents(
    time_s: NDArray[np.float64], frames: slice, memory: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return when what a frame shows began and ended, s, for the frames of the slice.

    Parameters
    ----------
    time_s
        Presentation times of all frames of the recording, shape (n_frames,).
    memory
        How many earlier frames the response looks back at: 0 for SA-I, 1 for RA-I.
    """
    period = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    ends = np.append(time_s[1:], time_s[-1:] + period)
    indices = np.arange(len(time_s))[frames]
    return time_s[np.maximum(indices - memory, 0)], ends[indices]


def spatial_samples(response: xr.DataArray, frames: slice, memory: int) -> Samples:
    """Encode each frame as one sample, a tactile image `(sample, row, column)`.

    Parameters
    ----------
    response
        `(time, marker)` without NaN (see `channels.fill`), with the markers' `row` and `column`,
        and the recording's `name`, `texture` and `speed_mm_s` in the attributes.
    frames
        Those to encode.
    memory
        How many earlier frames the response looks back at: 0 for SA-I, 1 for RA-I.

    Returns
    -------
    xarray.DataArray
        In the response's unit; on `sample` stand `texture`, `speed_mm_s` (mm/s), `recording`,
        `start_s` and `stop_s` (s).

    Raises
    ------
    InputError
        If markers were lost, or form no grid.
    """
    start_s, stop_s = frame_extents(response[dims.TIME].values, frames, memory)
    images = tactile_images(response.isel({dims.TIME: frames}))
    return make_samples(images, (dims.ROW, dims.COLUMN), start_s, stop_s, response.attrs)

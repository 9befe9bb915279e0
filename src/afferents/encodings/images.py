"""Tactile images as samples: one a frame, or runs of ten (paper, section 2.2.1)."""

from collections import deque
from typing import Annotated

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import PositiveInt

from afferents import dims
from afferents.encodings.augment import RANGES, Stretch, faster_images, faster_runs
from afferents.encodings.base import Floats, ImageEncoding, Option, require_run
from afferents.encodings.samples import Samples, make_samples
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


# Spatio-temporal encoding: runs of ten tactile images (paper, section 2.2.1).

FRAMES = 10
"""Frames a sample, 0.111 s at 90 fps."""
FRAMES_OPTION = Option(
    "--frames",
    "Length of a run of tactile images, video frames; 'evaluate' also takes several: 1,2,5,10.",
    str,
)


class SpatiotemporalEncoding(ImageEncoding):
    """A run of tactile images is a sample (frame, row, column).

    Attributes
    ----------
    frames
        Images a sample; the paper has ten.
    """

    name, sample_dims = "spatiotemporal", (dims.FRAME, dims.ROW, dims.COLUMN)

    frames: Annotated[PositiveInt, FRAMES_OPTION] = FRAMES

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return self.frames

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, frame, row, column)`; see `spatiotemporal_samples`."""
        return spatiotemporal_samples(response, kept, lookback, self.frames)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs."""
        return runs[:, :, 0]

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
        """Return two copies of every run as other speeds would give them; see `faster_runs`."""
        return faster_runs(samples, index, rng)

    def stream(self, lookback: int) -> "LastRun":
        """Return what gives, at every image, the run that it ends."""
        return LastRun(self.frames)


class LastRun:
    """The last images, where offline one run follows the other.

    Parameters
    ----------
    frames
        Images of a run.
    """

    def __init__(self, frames: int) -> None:
        """Wait for the first run to fill."""
        self._images: deque[Floats] = deque(maxlen=frames)

    def skip(self) -> None:
        """Begin anew: no run may hold both sides of a gap."""
        self._images.clear()

    def feed(self, image: Floats) -> Floats | None:
        """Return the run (frame, row, column) that an image ends; None until one is full."""
        self._images.append(image)
        return np.stack(self._images) if len(self._images) == self._images.maxlen else None


def spatiotemporal_samples(
    response: xr.DataArray, frames: slice, memory: int, length: int = FRAMES
) -> Samples:
    """Encode non-overlapping runs of `length` frames as `(sample, frame, row, column)`.

    A last incomplete run is dropped; runs never cross recordings, since each call sees one.

    Raises
    ------
    InputError
        If the recording has fewer than `length` frames in the slice.
    """
    start_s, stop_s = frame_extents(response[dims.TIME].values, frames, memory)
    n = len(start_s) // length
    require_run(len(start_s), response.attrs.get("name", "a recording"), length)
    images = tactile_images(response.isel({dims.TIME: frames}))[: n * length]
    return make_samples(
        images.reshape(n, length, *images.shape[1:]),
        (dims.FRAME, dims.ROW, dims.COLUMN),
        start_s[: n * length : length],
        stop_s[length - 1 : n * length : length],
        response.attrs,
    )

"""Spatial encoding: one tactile image a frame (paper, section 2.2.1)."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.samples import Samples, make_samples
from afferents.encodings.base import Floats, ImageEncoding


class SpatialEncoding(ImageEncoding):
    """Every frame is a sample, a tactile image (row, column); it has no options."""

    name, sample_dims = "spatial", (dims.ROW, dims.COLUMN)

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, row, column)`; see `spatial_samples`."""
        return spatial_samples(response, kept, lookback)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs of one."""
        return runs[:, 0, 0]

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


def tactile_images(response: xr.DataArray) -> NDArray[np.float32]:
    """Lay the markers of every frame out as an image.

    Parameters
    ----------
    response
        SA-I or RA-I `(time, marker)` with the coordinates `row` and `column` on `marker`.

    Returns
    -------
    Array of shape (time, row, column), float32, in the response's unit. Row is the rank of a
    marker in y, column its rank in x; the published arrays are the transpose.

    Raises
    ------
    InputError
        If the markers form no grid, or if lost markers (NaN) were not filled before.
    """
    where = f"{response.name} of {response.attrs.get('name', 'a recording')}"
    if dims.ROW not in response.coords or dims.COLUMN not in response.coords:
        raise InputError(
            where,
            "markers in a grid (coordinates row and column)",
            "a free layout",
            "use the vibrotactile models, or a sensor file with a square layout",
        )
    if bool(response.isnull().any()):
        raise InputError(where, "lost markers filled", "NaN", "fill them with channels.hold")
    rows, columns = response[dims.ROW].values, response[dims.COLUMN].values
    shape = (response.sizes[dims.TIME], int(rows.max()) + 1, int(columns.max()) + 1)
    images = np.zeros(shape, dtype=np.float32)
    images[:, rows, columns] = response.transpose(dims.TIME, dims.MARKER).values
    return images


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
        `(time, marker)` without NaN (see `hold`), with the markers' `row` and `column`, and the
        recording's `name`, `texture` and `speed_mm_s` in the attributes.
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


def image_runs(response: xr.DataArray, frames: slice, length: int) -> NDArray[np.float32]:
    """Return runs of tactile images that follow each other; a last incomplete one is dropped.

    Parameters
    ----------
    response
        `(time, marker)` or `(time, marker, space)`; see `tactile_images`.
    frames
        Frames that the cut keeps.
    length
        Images of a run.

    Returns
    -------
    Shape (run, frame, component, row, column), in the response's unit.
    """
    images = component_images(response.isel({dims.TIME: frames}))
    n = len(images) // length
    return images[: n * length].reshape(n, length, *images.shape[1:])


def component_images(response: xr.DataArray) -> NDArray[np.float32]:
    """Return tactile images (time, component, row, column) of a length or of a vector."""
    if dims.SPACE not in response.dims:
        return tactile_images(response)[:, None]
    parts = (response.isel({dims.SPACE: i}, drop=True) for i in range(response.sizes[dims.SPACE]))
    return np.stack([tactile_images(part) for part in parts], axis=1)

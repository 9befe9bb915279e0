"""Frames as samples: tactile images, one or runs of ten (paper, section 2.2.1), or markers.

Markers without rows and columns give what each shows, or its moments over a run of frames.
"""

from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import PositiveInt

from afferents import dims
from afferents.encodings.augment import RANGES, Stretch, faster_images, faster_runs
from afferents.encodings.base import Floats, Indices, Option
from afferents.encodings.frames import RunsLive
from afferents.encodings.samples import Samples
from afferents.errors import InputError


def _take_lengths(runs: Floats) -> Floats:
    """Return runs (n, frame, row, column) of a response that is one number a marker."""
    if runs.shape[2] != 1:
        raise InputError(
            "the encoding: expected a response of one number a marker, such as sa1 or ra1, found "
            f"{runs.shape[2]} components; take the encoding markers or wavenumbers"
        )
    return runs[:, :, 0]


class SpatialEncoding(RunsLive):
    """Every frame is a sample, a tactile image (row, column); it has no options."""

    name, sample_dims = "spatial", (dims.ROW, dims.COLUMN)
    n_copies = len(RANGES)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs of one."""
        return _take_lengths(runs)[:, 0]

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return two copies of every sample as at other speeds; see `faster_images`."""
        return faster_images(samples, index, rng)


FRAMES = 10
"""Frames a sample, 0.111 s at 90 fps."""
FRAMES_OPTION = Option(
    "--frames",
    "Length of a run of tactile images, video frames; 'evaluate' also takes several: 1,2,5,10.",
    str,
)


class RunsOfFrames(RunsLive):
    """An encoding of runs whose length is an option."""

    frames: Annotated[PositiveInt, FRAMES_OPTION] = FRAMES

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return self.frames


class SpatiotemporalEncoding(RunsOfFrames):
    """A run of tactile images is a sample (frame, row, column).

    Attributes
    ----------
    frames
        Images a sample; the paper has ten.
    """

    name, sample_dims = "spatiotemporal", (dims.FRAME, dims.ROW, dims.COLUMN)
    n_copies = len(RANGES)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs."""
        return _take_lengths(runs)

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return two copies of every sample as at other speeds; see `faster_runs`."""
        return faster_runs(samples, index, rng)


class MarkersEncoding(RunsLive):
    """Every frame is a sample (component, marker); it has no options.

    For your own estimators, which need no rows and columns, and for any layout. Markers stand
    in the order of the layout: of a square one by row, then column, else as the sensor file lists
    them. A length has one component, a vector two (x, y).
    """

    name, sample_dims = "markers", (dims.COMPONENT, dims.MARKER)
    of_pixels = False

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the frames of runs of one."""
        return runs[:, 0]


_LEAST_SPREAD = 1e-3
"""In px: what is still to better than that is no stiller for a model."""


class MomentEncoding(RunsOfFrames):
    """The mean and the logarithm of the spread over a run of frames are a sample (moment, feature).

    Of each marker and component, or of each part of the global shear, one after the other: means
    in px, then ln of spreads in px. The mean over a run is the level that friction holds the skin
    at; it is a force, and does not depend on how fast the texture went by. The spread is what the
    texture and stick-slip add; at another speed it grows or shrinks by a factor, so its logarithm
    is taken.

    Attributes
    ----------
    frames
        Of a run.
    """

    name, sample_dims = "moments", (dims.MOMENT, dims.FEATURE)
    of_pixels, keeps_unit = False, False

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the moments of runs, (run, moment, feature)."""
        spread = np.log(np.maximum(runs.std(axis=1), _LEAST_SPREAD))
        moments = np.stack([runs.mean(axis=1), spread], axis=1)
        return moments.reshape(len(runs), 2, -1).astype(np.float32)

    def coordinates(self, runs: Floats) -> dict[str, Any]:
        """Return the names of both moments."""
        return {dims.MOMENT: ["mean", "log_spread"]}


def spatial_samples(response: xr.DataArray, frames: slice, memory: int) -> Samples:
    """Encode each frame as one sample, a tactile image `(sample, row, column)`.

    Parameters
    ----------
    response
        `(time, marker)` without NaN (see `filling.fill`), with the markers' `row` and `column`,
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
    return SpatialEncoding().samples(response, frames, memory)


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
    return SpatiotemporalEncoding(frames=length).samples(response, frames, memory)

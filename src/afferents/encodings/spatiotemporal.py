"""Spatio-temporal encoding: runs of ten tactile images (paper, section 2.2.1)."""

import xarray as xr

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.samples import Samples, make_samples
from afferents.encodings.spatial import frame_extents, tactile_images

FRAMES = 10
"""Frames a sample, 0.111 s at 90 fps."""


def require_run(n_frames: int, where: str, length: int = FRAMES) -> None:
    """Refuse a recording with fewer than `length` frames after the cut."""
    if n_frames < length:
        raise InputError(where, f"at least {length} frames after the cut", f"{n_frames}")


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

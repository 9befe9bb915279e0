"""Samples: what a model learns from, each carrying where and when it was taken.

A `Samples` is an `xarray.DataArray` whose first dim is `sample`, float32, with the coordinates
`texture`, `speed_mm_s`, `recording`, `start_s`, `stop_s` on it. `start_s` to `stop_s` is
everything a sample has seen: an RA-I image begins one frame earlier than the frame it shows.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError

Samples = xr.DataArray


def make_samples(
    values: NDArray[np.float32],
    sample_dims: Sequence[str],
    start_s: NDArray[np.float64],
    stop_s: NDArray[np.float64],
    attrs: Mapping[str, Any],
    coords: Mapping[str, Any] | None = None,
) -> Samples:
    """Label the samples of one recording.

    Parameters
    ----------
    values
        Shape (n_samples, *sample_shape).
    sample_dims
        Names of the dims after `sample`.
    start_s, stop_s
        Extent in time of each sample, shape (n_samples,), s.
    attrs
        Attributes of the recording's responses (name, texture, speed_mm_s).
    """
    n = len(values)
    on_sample = {
        dims.TEXTURE: np.full(n, attrs[dims.TEXTURE]),
        dims.SPEED: np.full(n, float(attrs[dims.SPEED])),
        dims.RECORDING: np.full(n, attrs["name"]),
        dims.START: start_s,
        dims.STOP: stop_s,
    }
    return xr.DataArray(
        values,
        dims=(dims.SAMPLE, *sample_dims),
        coords={**{k: (dims.SAMPLE, v) for k, v in on_sample.items()}, **(coords or {})},
    )


def concatenate(parts: Sequence[Samples]) -> Samples:
    """Join the samples of several recordings.

    Raises
    ------
    InputError
        If there is nothing to join, or if recordings differ in the shape of a sample.
    """
    if not parts:
        raise InputError("the data", "at least one recording with samples", "none")
    for part in parts:
        if part.shape[1:] != parts[0].shape[1:]:
            name = part[dims.RECORDING].values[:1]
            first = parts[0].sizes
            raise InputError(
                f"recording {', '.join(map(str, name))}",
                f"samples like those of the other recordings ({dict(first)})",
                f"{dict(part.sizes)}",
                "evaluate recordings of one sensor together",
            )
    return xr.concat(parts, dim=dims.SAMPLE, coords="different", compat="equals", join="exact")

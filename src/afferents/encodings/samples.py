"""Samples: what a model learns from, each carrying where and when it was taken.

A `Samples` is an `xarray.DataArray` whose first dim is `sample`, float32, with the coordinates
`texture`, `speed_mm_s`, `recording`, `start_s`, `stop_s` on it. `start_s` to `stop_s` is
everything a sample has seen: an RA-I image begins one frame earlier than the frame it shows.
Its attributes are `units`, that of the values, and `named_by_spacing`, where textures are.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.store.recording import natural_order

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
        Attributes of the response and its recording (units; name, texture, speed_mm_s).
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
        attrs={
            name: attrs[name] for name in (dims.UNITS, dims.NAMED_BY_SPACING) if attrs.get(name)
        },
    )


def concatenate(parts: Sequence[Samples]) -> Samples:
    """Join the samples of several recordings; attributes stay where all have the same.

    Raises
    ------
    InputError
        If there is nothing to join, or if recordings differ in the shape of a sample or in
        the frequencies of its bins.
    """
    if not parts:
        raise InputError("the data: expected at least one recording with samples, found none")
    for part in parts:
        if _form(part) != _form(parts[0]):
            name = part[dims.RECORDING].values[:1]
            raise InputError(
                f"recording {', '.join(map(str, name))}: expected samples like those of the other "
                f"recordings ({_form(parts[0])}), found {_form(part)}; evaluate recordings of one "
                "sensor together, in windows of one length"
            )
    joined = xr.concat(
        parts,
        dim=dims.SAMPLE,
        coords="different",
        compat="equals",
        join="exact",
        combine_attrs="drop_conflicts",
    )
    if not all(dims.NAMED_BY_SPACING in part.attrs for part in parts):
        joined.attrs.pop(dims.NAMED_BY_SPACING, None)
    return joined


def _form(samples: Samples) -> str:
    """Return in words what samples must share to be learnt from together."""
    sizes = (f"{n} {dim}" for dim, n in samples.sizes.items() if dim != dims.SAMPLE)
    form = " x ".join(map(str, sizes))
    if dims.FREQUENCY in samples.coords:
        form += f" up to {float(samples[dims.FREQUENCY][-1])} Hz"
    return form


def speeds_told(samples: Samples) -> NDArray[np.float64]:
    """Return each sample's sliding speed, mm/s, (n_samples,): its own mean where that is known."""
    name = dims.MEAN_SPEED if dims.MEAN_SPEED in samples.coords else dims.SPEED
    return np.asarray(samples[name].values)


def list_textures(samples: Samples) -> list[str]:
    """Return the textures in natural order, which is the order of the classes."""
    return sorted(map(str, np.unique(samples[dims.TEXTURE])), key=natural_order)


def find_labels(samples: Samples) -> NDArray[np.int64]:
    """Return the number of each sample's texture among `list_textures`, (n_samples,)."""
    number = {texture: i for i, texture in enumerate(list_textures(samples))}
    return np.array([number[str(texture)] for texture in samples[dims.TEXTURE].values])

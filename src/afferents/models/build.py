"""The network for an encoding, with reproducible first weights if it has any."""

import torch
from torch import nn

from afferents.core.errors import InputError
from afferents.models.cnn_lstm import CnnLstm
from afferents.models.ridge import Ridge
from afferents.models.spatial import SpatialNet
from afferents.models.vibration import VibrationNet

_SAMPLE_DIMS: dict[str, tuple[str, ...]] = {
    "spatial": ("row", "column"),
    "spatiotemporal": ("frame", "row", "column"),
    "spectral": ("channel", "frequency"),
    "wavenumbers": ("component", "row_wavenumber", "column_wavenumber"),
}


def build(encoding: str, n_classes: int, sample_shape: tuple[int, ...], seed: int = 0) -> nn.Module:
    """Return the network for an encoding: the paper's, its weights drawn from `seed`, or a ridge.

    Parameters
    ----------
    encoding
        `spatial`, `spatiotemporal` or `spectral`; `wavenumbers` for a ridge.
    n_classes
        Number of textures, at least 2.
    sample_shape
        Shape of one sample: (row, column), (frame, row, column), (channel, frequency) or
        (component, row_wavenumber, column_wavenumber).
    seed
        Of the weights; the caller's random state is left as it was.

    Raises
    ------
    InputError
        If the samples have other dims or are too small, or there is nothing to tell apart.
    """
    if n_classes < 2:
        raise InputError("the data", "at least 2 textures to tell apart", f"{n_classes}")
    if len(sample_shape) != len(_SAMPLE_DIMS[encoding]):
        expected = f"({', '.join(_SAMPLE_DIMS[encoding])})"
        raise InputError(f"{encoding} samples", f"the shape {expected}", f"{sample_shape}")
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(seed)
        return _network(encoding, n_classes, sample_shape)


def _network(encoding: str, n_classes: int, sample_shape: tuple[int, ...]) -> nn.Module:
    if encoding == "spatial":
        return SpatialNet(n_classes, *sample_shape)
    if encoding == "spatiotemporal":
        return CnnLstm(n_classes, *sample_shape[1:])
    if encoding == "wavenumbers":
        return Ridge(n_classes, sample_shape)
    return VibrationNet(n_classes, *sample_shape)

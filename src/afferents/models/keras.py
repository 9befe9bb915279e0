"""Weights of the paper's networks as Keras wrote them, put into ours.

Keras' arrays and PyTorch's differ in the order of their dims. Beside that the published images are
the transpose of ours (axis 0 is the rank in x), and so are the kernels that learnt from them, and
the order in which the first layer after Flatten takes its inputs.
"""

from collections.abc import Sequence
from math import isqrt
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm

from afferents.core.errors import InputError
from afferents.models.base import Network

Floats = NDArray[np.float32]


class KerasArray(NamedTuple):
    """An array of a Keras network.

    Attributes
    ----------
    role
        What it is to its layer, as Keras names it: ``kernel``, ``recurrent_kernel``, ``bias``,
        ``gamma``, ``beta``, ``moving_mean`` or ``moving_variance``.
    values
        In the order of dims that Keras has: kernels (..., in, out).
    """

    role: str
    values: Floats


@torch.no_grad()
def put_keras_weights(
    network: Network, arrays: Sequence[KerasArray], where: object = "weights"
) -> None:
    """Put a Keras network's weights into ours of the same layers, in place.

    Layers are told by their order alone, so what they are called, and whether each is wrapped for
    every frame (``TimeDistributed``) or all of them together, does not matter. Images that the
    network learnt from are taken to be transposed, as published; feed it ours.

    Parameters
    ----------
    network
        A `SpatialNet`, `CnnLstm` or `VibrationNet` for as many textures.
    arrays
        Of all layers, in their order.
    where
        The file, for the error.

    Raises
    ------
    InputError
        If there are too few or too many arrays, or one has another shape. The network is then
        worth nothing.
    """
    taken = _Taken(arrays, where)
    flattened = _Flattened()
    for module in network.modules():
        if isinstance(module, nn.Conv2d):
            kernel = taken.next("kernel")
            flattened = _Flattened(kernel.shape[-1], of_images=kernel.ndim == 4)
            taken.put(module.weight, _as_ours(kernel))
            taken.put(module.bias, taken.next("bias"))
        elif isinstance(module, nn.Linear):
            taken.put(module.weight, flattened.as_ours(taken.next("kernel")).T)
            taken.put(module.bias, taken.next("bias"))
            flattened = _Flattened()
        elif isinstance(module, _BatchNorm):
            _put_normalisation(module, taken)
        elif isinstance(module, nn.LSTM):
            _put_lstm(module, taken, flattened)
            flattened = _Flattened()
    taken.require_all()


class _Flattened(NamedTuple):
    """What Flatten makes of feature maps, channel running fastest; no channels for no maps."""

    channels: int = 0
    of_images: bool = False

    def as_ours(self, kernel: Floats) -> Floats:
        """Return a kernel (in, out) with its inputs in our order: rows of the image first."""
        side = isqrt(len(kernel) // self.channels) if self.of_images else 0
        if side**2 * self.channels != len(kernel) or not side:
            return kernel
        maps = kernel.reshape(side, side, self.channels, -1)
        return maps.swapaxes(0, 1).reshape(len(kernel), -1)


class _Taken:
    """Arrays that are taken in their order, those of each role apart."""

    def __init__(self, arrays: Sequence[KerasArray], where: object) -> None:
        self._where = where
        self._left: dict[str, list[Floats]] = {}
        for role, values in arrays:
            self._left.setdefault(role, []).append(values)

    def next(self, role: str) -> Floats:
        if not self._left.get(role):
            raise InputError(self._where, f"another {role} for the layers of this network", "none")
        return self._left[role].pop(0)

    def put(self, ours: Tensor | None, values: Floats) -> None:
        assert ours is not None
        if tuple(ours.shape) != values.shape:
            expected, found = (" x ".join(map(str, shape)) for shape in (ours.shape, values.shape))
            raise InputError(self._where, f"weights of {expected} in this layer", found)
        ours.copy_(torch.from_numpy(np.ascontiguousarray(values)))

    def require_all(self) -> None:
        if left := {role: len(arrays) for role, arrays in self._left.items() if arrays}:
            found = ", ".join(f"{n} of the kind {role}" for role, n in left.items())
            raise InputError(self._where, "no more weights than this network has", f"{found} more")


def _as_ours(kernel: Floats) -> Floats:
    """Return a kernel (x, y, in, out) as (out, in, row, column), or (bin, in, out) with one row."""
    turned = kernel.transpose()
    return turned if kernel.ndim == 4 else turned[:, :, None, :]


def _put_normalisation(module: _BatchNorm, taken: _Taken) -> None:
    taken.put(module.weight, taken.next("gamma"))
    taken.put(module.bias, taken.next("beta"))
    taken.put(module.running_mean, taken.next("moving_mean"))
    taken.put(module.running_var, taken.next("moving_variance"))


def _put_lstm(lstm: nn.LSTM, taken: _Taken, flattened: _Flattened) -> None:
    """Put the layers of an LSTM: gates lie alike, and Keras' one bias is the first of our two."""
    for layer in range(lstm.num_layers):
        kernel = taken.next("kernel")
        kernel = kernel if layer else flattened.as_ours(kernel)
        taken.put(lstm.get_parameter(f"weight_ih_l{layer}"), kernel.T)
        taken.put(lstm.get_parameter(f"weight_hh_l{layer}"), taken.next("recurrent_kernel").T)
        taken.put(lstm.get_parameter(f"bias_ih_l{layer}"), taken.next("bias"))
        lstm.get_parameter(f"bias_hh_l{layer}").zero_()

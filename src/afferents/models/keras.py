"""Weights of the paper's networks as Keras wrote them, read without it and put into ours."""

import json
from collections.abc import Iterator, Sequence
from math import isqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm

from afferents.errors import InputError
from afferents.models.base import Network
from afferents.plugins import import_extra

# Keras' arrays and PyTorch's differ in the order of their dims. Beside that the published images
# are the transpose of ours (axis 0 is the rank in x), and so are the kernels that learnt from
# them, and the order in which the first layer after Flatten takes its inputs.

Floats = NDArray[np.float32]


@torch.no_grad()
def load_keras_weights(network: Network, path: Path) -> None:
    """Read the weights of one of the paper's networks into ours, in place; needs `h5py`.

    Layers are told by their order alone, so what they are called, and whether each is wrapped for
    every frame (``TimeDistributed``) or all of them together, does not matter. Images that the
    network learnt from are taken to be transposed, as published; feed it ours.

    Parameters
    ----------
    network
        A `SpatialNet`, `CnnLstm` or `VibrationNet` for as many textures and samples of the same
        shape: `models.classifiers.build`.
    path
        As ``model.save`` or ``model.save_weights`` of Keras 2 writes it.

    Raises
    ------
    InputError
        If the file is missing, none of Keras', of another network (with too few or too many
        arrays, or one of another shape), or its layers are set otherwise than ours (LSTMs with hard
        sigmoid gates). The network is then worth nothing.
    """
    taken = _Taken(_arrays_in(path), path)
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
        if not self.of_images:
            return kernel
        side = isqrt(len(kernel) // self.channels)
        if side**2 * self.channels != len(kernel):
            raise InputError(
                f"the network: expected square images, whose rows can be told from columns, found "
                f"{len(kernel) // self.channels} places after the last convolution"
            )
        maps = kernel.reshape(side, side, self.channels, -1)
        return maps.swapaxes(0, 1).reshape(len(kernel), -1)


class _Taken:
    """Arrays that are taken in their order, those of each role apart."""

    def __init__(self, arrays: Sequence[tuple[str, Floats]], path: Path) -> None:
        self._path = path
        self._left: dict[str, list[Floats]] = {}
        for role, values in arrays:
            self._left.setdefault(role, []).append(values)

    def next(self, role: str) -> Floats:
        if not self._left.get(role):
            raise InputError(
                f"{self._path}: expected another {role} for the layers of this network, found none"
            )
        return self._left[role].pop(0)

    def put(self, ours: Tensor | None, values: Floats) -> None:
        assert ours is not None
        if tuple(ours.shape) != values.shape:
            expected, found = (" x ".join(map(str, shape)) for shape in (ours.shape, values.shape))
            raise InputError(
                f"{self._path}: expected weights of {expected} in this layer, found {found}"
            )
        ours.copy_(torch.from_numpy(np.ascontiguousarray(values)))

    def require_all(self) -> None:
        if left := {role: len(arrays) for role, arrays in self._left.items() if arrays}:
            found = ", ".join(f"{n} of the kind {role}" for role, n in left.items())
            raise InputError(
                f"{self._path}: expected no more weights than this network has, found {found} more"
            )


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


# Networks that Keras saved as HDF5 (.hdf5, .h5): their weights, read without Keras.
#
# Such a file is data: arrays, names, and the layers' settings as JSON. Nothing in it is run, which
# cannot be said of a pickle.

_WEIGHTS = "model_weights"
_WHAT = "a network that Keras saved as HDF5"
_LARGEST = 10_000_000
"""Values of one array: those of the paper's networks have at most 147,456."""
_SETTINGS: dict[str, dict[str, str | float]] = {
    "LSTM": {"activation": "tanh", "recurrent_activation": "sigmoid"},
    "BatchNormalization": {"epsilon": 0.001},
}
"""What our layers do; a file that says otherwise of its own would give other outputs."""


def _arrays_in(path: Path) -> list[tuple[str, Floats]]:
    """Return the arrays of all layers of a network that Keras saved, in the layers' order.

    Each with its role, what it is to its layer as Keras names it: ``kernel``,
    ``recurrent_kernel``, ``bias``, ``gamma``, ``beta``, ``moving_mean`` or ``moving_variance``. Its
    dims are in the order that Keras has: kernels (..., in, out).
    """
    h5py = import_extra("hdf5", str(path), "h5py")
    if not path.is_file():
        raise InputError(f"{path}: expected {_WHAT}, found no such file")
    try:
        with h5py.File(path, "r") as file:
            _require_settings(path, file.attrs.get("model_config"))
            return list(_arrays(path, file.get(_WEIGHTS, file)))
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: expected {_WHAT}, found {error!s}") from error


def _arrays(path: Path, weights: Any) -> Iterator[tuple[str, Floats]]:
    if "layer_names" not in weights.attrs:
        raise InputError(f"{path}: expected {_WHAT}, found no list of layers")
    for layer in map(_text, weights.attrs["layer_names"]):
        group = weights[layer]
        for name in map(_text, group.attrs["weight_names"]):
            role = name.rpartition("/")[2].partition(":")[0]
            if group[name].size > _LARGEST:
                found = f"an array of {group[name].size:,} values"
                raise InputError(
                    f"{path}: expected a network as small as the paper's, found {found}"
                )
            yield role, np.asarray(group[name][()], dtype=np.float32)


def _require_settings(path: Path, config: Any) -> None:
    """Refuse layers that do something else than ours, where the file says what they do."""
    for layer in _layers(json.loads(_text(config))) if config is not None else ():
        settings = layer.get("config", {})
        for name, ours in _SETTINGS.get(layer["class_name"], {}).items():
            theirs = settings.get(name, ours)
            same = np.isclose(theirs, ours) if isinstance(ours, float) else theirs == ours
            if not same:
                expected = f"{layer['class_name']} with {name} = {ours}, as our networks have it"
                raise InputError(f"{path}: expected {expected}, found {theirs}")


def _layers(config: Any) -> Iterator[dict[str, Any]]:
    """Yield the layers in a description of a network, those in wrappers and networks within too."""
    if isinstance(config, dict):
        if isinstance(config.get("class_name"), str):
            yield config
        for part in config.values():
            yield from _layers(part)
    elif isinstance(config, list):
        for part in config:
            yield from _layers(part)


def _text(name: Any) -> str:
    return name.decode() if isinstance(name, bytes) else str(name)

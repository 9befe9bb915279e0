"""Networks that Keras saved as HDF5 (.hdf5, .h5): their weights, read without Keras.

Such a file is data: arrays, names, and the layers' settings as JSON. Nothing in it is run, which
cannot be said of a pickle.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from afferents.core.errors import InputError
from afferents.core.extras import import_extra
from afferents.models import KerasArray, Network, put_keras_weights

_WEIGHTS = "model_weights"
_WHAT = "a network that Keras saved as HDF5"
_LARGEST = 10_000_000
"""Values of one array: those of the paper's networks have at most 147,456."""
_SETTINGS: dict[str, dict[str, str | float]] = {
    "LSTM": {"activation": "tanh", "recurrent_activation": "sigmoid"},
    "BatchNormalization": {"epsilon": 0.001},
}
"""What our layers do; a file that says otherwise of its own would give other outputs."""


def load_keras_weights(network: Network, path: Path) -> None:
    """Read the weights of one of the paper's networks into ours, in place; needs `h5py`.

    Parameters
    ----------
    network
        For as many textures and samples of the same shape: `models.build`.
    path
        As ``model.save`` or ``model.save_weights`` of Keras 2 writes it. Its network learnt from
        transposed images, as published; ours takes images (row, column).

    Raises
    ------
    InputError
        If the file is missing, none of Keras', of another network, or its layers are set otherwise
        than ours (LSTMs with hard sigmoid gates).
    """
    put_keras_weights(network, read_keras_weights(path), path)


def read_keras_weights(path: Path) -> list[KerasArray]:
    """Return the arrays of all layers of a network that Keras saved, in the layers' order.

    Raises
    ------
    InputError
        As `load_keras_weights`.
    """
    h5py = import_extra("hdf5", str(path), "h5py")
    if not path.is_file():
        raise InputError(path, _WHAT, "no such file")
    try:
        with h5py.File(path, "r") as file:
            _require_settings(path, file.attrs.get("model_config"))
            return list(_arrays(path, file.get(_WEIGHTS, file)))
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(path, _WHAT, str(error)) from error


def _arrays(path: Path, weights: Any) -> Iterator[KerasArray]:
    if "layer_names" not in weights.attrs:
        raise InputError(path, _WHAT, "no list of layers")
    for layer in map(_text, weights.attrs["layer_names"]):
        group = weights[layer]
        for name in map(_text, group.attrs["weight_names"]):
            role = name.rpartition("/")[2].partition(":")[0]
            if group[name].size > _LARGEST:
                found = f"an array of {group[name].size:,} values"
                raise InputError(path, "a network as small as the paper's", found)
            yield KerasArray(role, np.asarray(group[name][()], dtype=np.float32))


def _require_settings(path: Path, config: Any) -> None:
    """Refuse layers that do something else than ours, where the file says what they do."""
    for layer in _layers(json.loads(_text(config))) if config is not None else ():
        settings = layer.get("config", {})
        for name, ours in _SETTINGS.get(layer["class_name"], {}).items():
            theirs = settings.get(name, ours)
            same = np.isclose(theirs, ours) if isinstance(ours, float) else theirs == ours
            if not same:
                expected = f"{layer['class_name']} with {name} = {ours}, as our networks have it"
                raise InputError(path, expected, f"{theirs}")


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

"""Networks that Keras saved give the same outputs here (files: scripts/keras_networks.py)."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from afferents.errors import InputError
from afferents.models.classifiers import build
from afferents.models.keras import load_keras_weights

h5py = pytest.importorskip("h5py")

FILES = Path(__file__).parent / "keras"
NETWORKS = {
    "se": ("spatial-net", (19, 19)),
    "ste": ("cnn-lstm", (10, 19, 19)),
    "te": ("vibration-net", (1, 200)),
}


def ours(name, samples):
    """Return published samples as ours are: images turned, spectra with a channel."""
    return samples[:, None] if name == "te" else samples.swapaxes(-1, -2)


@pytest.fixture
def said():
    with np.load(FILES / "said.npz") as arrays:
        return dict(arrays)


@pytest.mark.parametrize("name", NETWORKS)
def test_outputs_are_those_of_keras(name, said):
    classifier, shape = NETWORKS[name]
    network = build(classifier, 13, shape)
    load_keras_weights(network, FILES / f"{name}.hdf5")
    samples = torch.from_numpy(ours(name, said[f"{name}_samples"] / np.float32(8)).copy())
    with torch.no_grad():
        outputs = network.eval()(samples).softmax(1).numpy()
    assert np.ptp(outputs) > 0.3  # it is sure of something
    np.testing.assert_allclose(outputs, said[f"{name}_outputs"], atol=1e-5)


def test_the_layers_names_and_how_frames_are_wrapped_do_not_matter(tmp_path):
    """One wrapper round all layers of the images: Keras then names moving statistics last."""
    one, other = tmp_path / "one.h5", tmp_path / "other.h5"
    with h5py.File(FILES / "ste.hdf5") as source, h5py.File(one, "w") as target:
        weights, within = source["model_weights"], []
        layers = [_text(layer) for layer in weights.attrs["layer_names"]]
        for layer in layers:
            if layer.startswith("time_distributed"):
                names = weights[layer].attrs["weight_names"]
                within += [(_text(name), weights[layer][_text(name)][()]) for name in names]
        within.sort(key=lambda named: "moving" in named[0])
        group = target.create_group("images")
        for name, values in within:
            group[name] = values
        group.attrs["weight_names"] = [name for name, _ in within]
        rest = [layer for layer in layers if not layer.startswith("time_distributed")]
        for layer in rest:
            source.copy(weights[layer], target)
        target.attrs["layer_names"] = ["images", *rest]
    shutil.copy(FILES / "ste.hdf5", other)
    states = []
    for path in (one, other):
        network = build("cnn-lstm", 13, (10, 19, 19))
        load_keras_weights(network, path)
        states.append(network.state_dict())
    assert all(torch.equal(states[0][name], states[1][name]) for name in states[0])


@pytest.mark.parametrize(
    ("classifier", "n_classes", "shape", "name", "sentence"),
    [
        ("spatial-net", 12, (19, 19), "se", "weights of 12 x 16 in this layer, found 13 x 16"),
        ("cnn-lstm", 13, (10, 19, 19), "se", "layer, found 32 x 1152"),
        ("spatial-net", 13, (19, 19), "te", "this layer, found 128 x 1 x 1 x 5"),
        ("spatial-net", 13, (19, 19), "said", "a network that Keras saved as HDF5, found"),
        ("spatial-net", 13, (19, 19), "none", "found no such file"),
    ],
)
def test_files_of_other_networks_are_refused(classifier, n_classes, shape, name, sentence):
    network = build(classifier, n_classes, shape)
    path = FILES / f"{name}.{'npz' if name == 'said' else 'hdf5'}"
    with pytest.raises(InputError, match=sentence):
        load_keras_weights(network, path)


def test_gates_that_ours_have_not_are_refused(tmp_path):
    path = tmp_path / "hard.hdf5"
    shutil.copy(FILES / "ste.hdf5", path)
    with h5py.File(path, "r+") as file:
        config = json.loads(file.attrs["model_config"])
        lstm = next(one for one in config["config"]["layers"] if one["class_name"] == "LSTM")
        lstm["config"]["recurrent_activation"] = "hard_sigmoid"
        file.attrs["model_config"] = json.dumps(config)
    with pytest.raises(InputError, match=r"LSTM with recurrent_activation = sigmoid.*hard_sigmoid"):
        load_keras_weights(build("cnn-lstm", 13, (10, 19, 19)), path)


def _text(name):
    return name.decode() if isinstance(name, bytes) else str(name)

"""Make the files by which reading the authors' networks is tested.

Run it in an environment of its own, with Keras 2 as the authors had it:

    python -m venv keras && keras/bin/pip install 'tensorflow-cpu==2.15.*' h5py
    keras/bin/python scripts/keras_networks.py tests/unit/models/keras

The three networks are built layer by layer as in the authors' code, saved by Keras as .hdf5, and
asked about eight samples. Their weights are drawn from three values each, so that the files can be
packed: gzip leaves a tenth of the megabyte that each of them has otherwise. Nothing else is changed
in what Keras wrote.
"""

import sys
from pathlib import Path

import h5py
import keras
import numpy as np
from keras import layers
from keras.regularizers import l2

N_CLASSES, N_SAMPLES = 13, 8
PACKING = {"compression": 9, "shuffle": True}


def spatial() -> keras.Model:
    """Return SA-SE and RA-SE (spatial/train_static.ipynb, cell 4)."""
    return keras.Sequential([
        keras.Input((19, 19, 1)),
        *_images(),
        layers.Dropout(0.4),
        *_dense(32, 0.4),
        *_dense(16, 0.2),
        layers.Dense(N_CLASSES, activation="softmax", kernel_regularizer=l2(0.005)),
    ])  # fmt: skip


def spatiotemporal() -> keras.Model:
    """Return SA-STE and RA-STE (spatiotemporal/train_dynamic.ipynb, cell 4)."""
    return keras.Sequential([
        keras.Input((10, 19, 19, 1)),
        *(layers.TimeDistributed(layer) for layer in _images()),
        layers.LSTM(10, return_sequences=True),
        layers.LSTM(10, return_sequences=True),
        layers.LSTM(10),
        layers.Dropout(0.4),
        *_dense(32, 0.2),
        *_dense(16, 0.2),
        layers.Dense(N_CLASSES, activation="softmax", kernel_regularizer=l2(0.005)),
    ])  # fmt: skip


def vibration() -> keras.Model:
    """Return vib-TE (vibrotactile/train_vibration.ipynb, cell 4)."""
    return keras.Sequential([
        keras.Input((200, 1)),
        layers.Conv1D(128, 5, padding="same", activation="relu"),
        layers.MaxPooling1D(3),
        layers.BatchNormalization(),
        layers.Conv1D(128, 5, padding="same", activation="relu"),
        layers.BatchNormalization(),
        layers.MaxPooling1D(3),
        layers.Conv1D(128, 5, padding="same", activation="relu"),
        layers.BatchNormalization(),
        layers.MaxPooling1D(3),
        layers.Conv1D(128, 5, activation="relu"),
        layers.BatchNormalization(),
        layers.Flatten(),
        layers.Dropout(0.4),
        layers.Dense(32, activation="relu", kernel_regularizer=l2(0.005)),
        layers.Dense(N_CLASSES, activation="softmax"),
    ])  # fmt: skip


def _images() -> list[layers.Layer]:
    return [
        layers.Conv2D(64, 3, padding="same", activation="relu"),
        layers.MaxPooling2D(2),
        layers.BatchNormalization(),
        layers.Conv2D(128, 3, padding="same", activation="relu"),
        layers.BatchNormalization(),
        layers.Conv2D(128, 3, activation="relu"),
        layers.BatchNormalization(),
        layers.MaxPooling2D(2),
        layers.BatchNormalization(),
        layers.Flatten(),
    ]


def _dense(units: int, dropped: float) -> list[layers.Layer]:
    return [
        layers.Dense(units, activation="relu", kernel_regularizer=l2(0.005)),
        layers.BatchNormalization(),
        layers.Dropout(dropped),
    ]


def draw_weights(network: keras.Model, last_size: float, rng: np.random.Generator) -> None:
    """Draw every weight from three values, powers of two; kernels about as large as trained ones.

    The last kernel has a size of its own, so that samples are told apart, but not all too surely.
    """
    drawn, last = [], len(network.weights) - 2
    for number, variable in enumerate(network.weights):
        steps = rng.integers(-1, 2, variable.shape)
        if "variance" in variable.name or "gamma" in variable.name:
            drawn.append(2.0**steps)
        elif "kernel" in variable.name:
            fan_in = int(np.prod(variable.shape[:-1]))
            size = 2 ** np.ceil(np.log2((2 / fan_in) ** 0.5))
            drawn.append(steps * (last_size if number == last else size))
        else:
            drawn.append(steps / 8)
    network.set_weights(drawn)


def packed(written: Path, target: Path) -> None:
    """Copy an HDF5 file, its attributes as well, with its data sets compressed."""
    with h5py.File(written) as source, h5py.File(target, "w") as copy:
        copy.attrs.update(source.attrs)

        def take(name: str, found: h5py.Group | h5py.Dataset) -> None:
            if isinstance(found, h5py.Group):
                copy.require_group(name).attrs.update(found.attrs)
            else:
                copy.create_dataset(name, data=found[()], **(PACKING if found.size > 100 else {}))

        source.visititems(take)


NETWORKS = {"se": (spatial, 0.0625), "ste": (spatiotemporal, 4.0), "te": (vibration, 0.125)}
"""By the name of the encoding, with the size of the last kernel."""


def main(folder: Path) -> None:
    """Write the networks, and what they say of the samples."""
    folder.mkdir(parents=True, exist_ok=True)
    rng, said = np.random.default_rng(0), {}
    for name, (build, last_size) in NETWORKS.items():
        network = build()
        draw_weights(network, last_size, rng)
        written, target = folder / f"{name}.aside.hdf5", folder / f"{name}.hdf5"
        network.save(written)
        packed(written, target)
        written.unlink()
        samples = rng.integers(0, 16, (N_SAMPLES, *network.input_shape[1:])) / 8
        said[f"{name}_samples"] = (8 * samples[..., 0]).astype(np.uint8)
        said[f"{name}_outputs"] = network.predict(samples, verbose=0)
    np.savez_compressed(folder / "said.npz", **said)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

# ruff: noqa: ANN001, ANN201, ANN204 (Keras has no types)
"""The paper's networks in Keras, and their training samples a second; `training_speed.py` runs it.

    python keras_speed.py CASE BATCHES VALIDATION EPOCHS POLICY

Needs Keras with TensorFlow and NumPy, in whatever environment, and nothing of `afferents`: layers
as in the docstrings of its networks. POLICY is Keras' type policy, such as float32 or
mixed_bfloat16. Prints one number: samples a second of `fit`, validation included, median over the
epochs after the first.
"""

import os
import statistics
import sys
import time

os.environ["TF_CPP_MIN_LOG_LEVEL"] = "3"

import keras
import numpy as np
from keras import layers

BATCH, TEXTURES = 64, 13
L2 = keras.regularizers.l2(0.005)


def image_stack():
    """Return the layers that look at one tactile image."""
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


def dense(units):
    """Return a dense layer with its L2 term and batch normalisation."""
    return [
        layers.Dense(units, activation="relu", kernel_regularizer=L2),
        layers.BatchNormalization(),
    ]


def softmax(regularizer=None):
    """Return the last layer."""
    return layers.Dense(TEXTURES, activation="softmax", kernel_regularizer=regularizer)


def spatial():
    """Return SA-SE and RA-SE."""
    top = [*dense(32), layers.Dropout(0.4), *dense(16), layers.Dropout(0.2), softmax(L2)]
    return keras.Sequential([keras.Input((19, 19, 1)), *image_stack(), layers.Dropout(0.4), *top])


def spatiotemporal():
    """Return SA-STE and RA-STE."""
    images = [layers.TimeDistributed(layer) for layer in image_stack()]
    lstm = [layers.LSTM(10, return_sequences=True) for _ in range(2)] + [layers.LSTM(10)]
    top = [*dense(32), layers.Dropout(0.2), *dense(16), layers.Dropout(0.2), softmax(L2)]
    return keras.Sequential(
        [keras.Input((10, 19, 19, 1)), *images, *lstm, layers.Dropout(0.4), *top]
    )


def spectral():
    """Return vib-TE."""
    return keras.Sequential(
        [
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
            layers.Dense(32, activation="relu", kernel_regularizer=L2),
            softmax(),
        ]
    )


NETWORKS = {
    "spatial": (spatial, 261_709),
    "spatiotemporal": (spatiotemporal, 273_365),
    "spectral": (spectral, 261_709),
}


class Clock(keras.callbacks.Callback):
    """Seconds of every epoch, validation included."""

    def __init__(self):
        """Start with none."""
        super().__init__()
        self.seconds = []

    def on_epoch_begin(self, epoch, logs=None):
        """Start the clock."""
        self.began = time.perf_counter()

    def on_epoch_end(self, epoch, logs=None):
        """Stop it."""
        self.seconds.append(time.perf_counter() - self.began)


def samples_a_second(case, batches, n_validation, epochs):
    """Fit on random samples and return the rate."""
    make, parameters = NETWORKS[case]
    model = make()
    if model.count_params() != parameters:
        raise SystemExit(f"{case}: {model.count_params()} parameters, not {parameters}")
    n = batches * BATCH
    rng = np.random.default_rng(0)
    shape = (n + n_validation, *model.input_shape[1:])
    values = rng.normal(size=shape).astype(np.float32)
    labels = np.eye(TEXTURES, dtype=np.float32)[rng.integers(TEXTURES, size=len(values))]
    clock = Clock()
    model.compile("adam", loss="categorical_crossentropy", metrics=["accuracy"])
    model.fit(
        values[:n],
        labels[:n],
        batch_size=BATCH,
        epochs=epochs,
        validation_data=(values[n:], labels[n:]),
        validation_batch_size=256,
        callbacks=[clock],
        verbose=0,
    )
    return n / statistics.median(clock.seconds[1:])


if __name__ == "__main__":
    case, *sizes, policy = sys.argv[1:]
    keras.config.set_dtype_policy(policy)
    print(samples_a_second(case, *map(int, sizes)))

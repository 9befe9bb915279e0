"""The paper's networks: of one tactile image, of runs of them, and of vibration spectra.

Pestell & Lepora, J. R. Soc. Interface 2022, section 2.4; layers as in the authors' code (commit
880f9e4), which each class names.
"""

from contextlib import nullcontext
from typing import Self

import torch
from torch import Tensor, nn

from afferents import dims
from afferents.errors import InputError
from afferents.models import base, hardware, layers

SMALLEST_SIDE = 8
"""Rows and columns that leave at least one value a channel after the image stack."""
IMAGE_CHANNELS = 128
UNITS = 10
SMALLEST_SPECTRUM = 135
"""Bins that leave at least one value a channel after three poolings by 3 and the last kernel."""
CHANNELS = 128


class SpatialNet(base.Network):
    """Texture from one tactile image (SA-SE, RA-SE): three convolutions and two dense layers.

    Section 2.4.1; spatial/train_static.ipynb, cell 4.
    docs/paper.md lists its layers: 261,709 parameters, of which 260,717 are trainable, as Keras
    counts.

    Deviations: the outputs are logits, the softmax is in the loss and in prediction; rows and
    columns are those of the camera view, where the published arrays are transposed. The
    paper's text has dropout 0.4, 0.2, 0.2 and one normalisation a convolution; the code, which
    made the results, is followed.

    Parameters
    ----------
    n_classes
        Number of textures.
    n_rows, n_columns
        Size of the tactile image, at least 8 x 8.

    Raises
    ------
    InputError
        If the image is too small.
    """

    name = recipe = "spatial-net"
    light_dropout = (0.5, 0.0, 0.0)
    takes = (dims.ROW, dims.COLUMN)

    def __init__(self, n_classes: int, n_rows: int = 19, n_columns: int = 19) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        self.image = image_stack()
        self.dense = dense_layers(image_features(n_rows, n_columns), n_classes, second_dropout=0.4)
        layers.initialise_like_keras(self)

    def features(self, images: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, `image_features`).

        Of images (batch, row, column), px or px/frame.
        """
        features: Tensor = self.image(images.unsqueeze(1))
        return features


def image_stack() -> nn.Sequential:
    """Return the layers up to Flatten, which `CnnLstm` applies to every frame.

    Input (batch, 1, row, column), output (batch, `image_features`). ReLU comes after the
    first pooling instead of before: the two commute, and it has a quarter of the work.
    """
    return nn.Sequential(
        nn.Conv2d(1, 64, 3, padding=1),
        nn.MaxPool2d(2),
        nn.ReLU(),
        layers.batch_norm_maps(64),
        nn.Conv2d(64, 128, 3, padding=1),
        nn.ReLU(),
        layers.batch_norm_maps(128),
        nn.Conv2d(128, IMAGE_CHANNELS, 3),
        nn.ReLU(),
        layers.batch_norm_maps(128),
        nn.MaxPool2d(2),
        layers.batch_norm_maps(128),
        layers.FlattenChannelsLast(),
    )


def image_features(n_rows: int, n_columns: int) -> int:
    """Return how many values the image stack leaves of an image (1152 of 19 x 19).

    Raises
    ------
    InputError
        If nothing is left: fewer than 8 rows or columns.
    """
    if min(n_rows, n_columns) < SMALLEST_SIDE:
        raise InputError(
            f"tactile images: expected at least {SMALLEST_SIDE} x {SMALLEST_SIDE} markers for "
            f"this network, found {n_rows} x {n_columns}"
        )
    height, width = ((side // 2 - 2) // 2 for side in (n_rows, n_columns))
    return height * width * IMAGE_CHANNELS


class CnnLstm(base.Network):
    """Texture from a run of tactile images (SA-STE, RA-STE): a network a frame, then three LSTMs.

    Section 2.4.2; spatiotemporal/train_dynamic.ipynb, cell 4.
    docs/paper.md lists its layers: 273,365 parameters, of which 272,373 are trainable, as Keras
    counts. The frames share the image stack's weights, and its batch statistics run over all frames
    of a batch. The LSTMs have tanh and sigmoid gates. (The paper calls the model a ConvLSTM; it is
    none.)

    Deviations: the outputs are logits. PyTorch's LSTM has a second bias of 120 values in all,
    which stays zero and is not trained.

    Parameters
    ----------
    n_classes
        Number of textures.
    n_rows, n_columns
        Size of a tactile image, at least 8 x 8. The number of frames is free.

    Raises
    ------
    InputError
        If the images are too small.
    """

    name = recipe = "cnn-lstm"
    light_dropout = (0.2, 0.0, 0.0)
    takes = (dims.FRAME, dims.ROW, dims.COLUMN)

    @classmethod
    def built_for(cls, task: base.Task) -> Self:
        """Return one for samples (frame, row, column)."""
        return cls(task.n_classes, *task.sample_shape[1:])

    def __init__(self, n_classes: int, n_rows: int = 19, n_columns: int = 19) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        self.image = image_stack()
        features = image_features(n_rows, n_columns)
        self.lstm = nn.LSTM(features, UNITS, num_layers=3, batch_first=True)
        self.dense = dense_layers(UNITS, n_classes)
        layers.initialise_like_keras(self)

    def features(self, runs: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, 10), of runs (batch, frame, row, column)."""
        of_frames = self.image(runs.flatten(0, 1).unsqueeze(1))
        return last_state(self.lstm, of_frames.unflatten(0, runs.shape[:2]))


def dense_layers(n_features: int, n_classes: int, second_dropout: float = 0.2) -> nn.Sequential:
    """Return the dense layers behind the image stack or the LSTM, which differ in one dropout.

    (train_static.ipynb and train_dynamic.ipynb, cell 4.)
    """
    return nn.Sequential(
        nn.Dropout(0.4),
        layers.RegularisedLinear(n_features, 32),
        nn.ReLU(),
        layers.batch_norm_units(32),
        nn.Dropout(second_dropout),
        layers.RegularisedLinear(32, 16),
        nn.ReLU(),
        layers.batch_norm_units(16),
        nn.Dropout(0.2),
        layers.RegularisedLinear(16, n_classes),
    )


def last_state(lstm: nn.LSTM, of_frames: Tensor) -> Tensor:
    """Return the last state (batch, unit) of LSTMs that go through (batch, frame, feature).

    On a CPU that has no LSTM in bfloat16 it is computed in float32, whatever the rest of the
    network is in: it is a small part of the work.
    """
    apart = torch.is_autocast_enabled("cpu") and not hardware.takes_bfloat16()
    with torch.autocast("cpu", enabled=False) if apart else nullcontext():
        last: Tensor = lstm(of_frames.float() if apart else of_frames)[0][:, -1]
    return last


class VibrationNet(base.Network):
    """Texture from a vibration spectrum (vib-TE): four convolutions in one dimension, then dense.

    Section 2.4.3; vibrotactile/train_vibration.ipynb, cell 4.
    docs/paper.md lists its layers: 261,709 parameters, of which 260,685 are trainable, as Keras
    counts (that `SpatialNet` has the same total is a coincidence). With 16 vibration channels
    271,309.

    Deviations: the outputs are logits. The convolutions are written in two dimensions with a
    height of 1, which is the same arithmetic and faster on a CPU in channels_last order.

    Parameters
    ----------
    n_classes
        Number of textures.
    n_channels
        Vibration channels: 1 for a microphone, 16 for 16 taxels.
    n_frequencies
        Bins of the spectrum, at least 135.

    Raises
    ------
    InputError
        If the spectrum is too short.
    """

    name = recipe = "vibration-net"
    light_dropout = (0.2,)
    takes = (dims.CHANNEL, dims.FREQUENCY)

    def __init__(self, n_classes: int, n_channels: int = 1, n_frequencies: int = 200) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        if n_frequencies < SMALLEST_SPECTRUM:
            raise InputError(
                f"spectra: expected at least {SMALLEST_SPECTRUM} bins for this network, found "
                f"{n_frequencies}; pad the windows with zeros before the Fourier transform"
            )
        self.spectrum = nn.Sequential(
            _convolution(n_channels, "same"),
            nn.MaxPool2d((1, 3)),  # before its ReLU, with which it commutes: less work
            nn.ReLU(),
            layers.batch_norm_maps(CHANNELS),
            _convolution(CHANNELS, "same"),
            nn.ReLU(),
            layers.batch_norm_maps(CHANNELS),
            nn.MaxPool2d((1, 3)),
            _convolution(CHANNELS, "same"),
            nn.ReLU(),
            layers.batch_norm_maps(CHANNELS),
            nn.MaxPool2d((1, 3)),
            _convolution(CHANNELS, "valid"),
            nn.ReLU(),
            layers.batch_norm_maps(CHANNELS),
            layers.FlattenChannelsLast(),
        )
        self.dense = nn.Sequential(
            nn.Dropout(0.4),
            layers.RegularisedLinear((n_frequencies // 27 - 4) * CHANNELS, 32),
            nn.ReLU(),
            nn.Linear(32, n_classes),
        )
        layers.initialise_like_keras(self)

    def features(self, spectra: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, feature).

        Of spectra (batch, channel, frequency).
        """
        features: Tensor = self.spectrum(spectra.unsqueeze(2))
        return features


def _convolution(n_channels: int, padding: str) -> nn.Conv2d:
    return nn.Conv2d(n_channels, CHANNELS, (1, 5), padding=(0, 2 if padding == "same" else 0))

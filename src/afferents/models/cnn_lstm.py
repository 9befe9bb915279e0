"""The network of the spatio-temporal encoding: ten tactile images in a row (SA-STE, RA-STE).

Pestell & Lepora, J. R. Soc. Interface 2022, section 2.4.2; layers as in the authors' code,
spatiotemporal/train_dynamic.ipynb, cell 4 (commit 880f9e4).
"""

from contextlib import nullcontext
from typing import Self

import torch
from torch import Tensor, nn

from afferents.core import dims
from afferents.models.base import Network, Task
from afferents.models.layers import (
    RegularisedLinear,
    batch_norm_units,
    initialise_like_keras,
    takes_bfloat16,
)
from afferents.models.spatial import image_features, image_stack

UNITS = 10


class CnnLstm(Network):
    """Texture from a run of tactile images: a network for every frame, then three LSTMs.

    ============================  =================  ==========
    layer                         output             parameters
    ============================  =================  ==========
    image stack of `SpatialNet`   10 x 1152             223,872
    LSTM 10, sequence             10 x 10                46,520
    LSTM 10, sequence             10 x 10                   840
    LSTM 10, last state           10                        840
    Dropout 0.4                   10
    Dense 32, ReLU, L2            32                        352
    BatchNorm, Dropout 0.2        32                        128
    Dense 16, ReLU, L2            16                        528
    BatchNorm, Dropout 0.2        16                         64
    Dense 13, L2                  13                        221
    ============================  =================  ==========

    Together 273,365, of which 272,373 are trainable, as Keras counts. The frames share the
    image stack's weights, and its batch statistics run over all frames of a batch. The LSTMs
    have tanh and sigmoid gates. (The paper calls the model a ConvLSTM; it is none.)

    Deviations: the output are logits. PyTorch's LSTM has a second bias of 120 values in all,
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
    takes = (dims.FRAME, dims.ROW, dims.COLUMN)

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples (frame, row, column)."""
        return cls(task.n_classes, *task.sample_shape[1:])

    def __init__(self, n_classes: int, n_rows: int = 19, n_columns: int = 19) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        self.image = image_stack()
        features = image_features(n_rows, n_columns)
        self.lstm = nn.LSTM(features, UNITS, num_layers=3, batch_first=True)
        self.dense = dense_layers(UNITS, n_classes)
        initialise_like_keras(self)

    def features(self, runs: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, 10), of runs (batch, frame, row, column)."""
        of_frames = self.image(runs.flatten(0, 1).unsqueeze(1))
        return self.after(of_frames.unflatten(0, runs.shape[:2]))

    def after(self, of_frames: Tensor) -> Tensor:
        """Return the same of what the image stack made of the frames, (batch, frame, feature)."""
        return last_state(self.lstm, of_frames)


def dense_layers(n_features: int, n_classes: int) -> nn.Sequential:
    """Return the dense layers behind the LSTM (train_dynamic.ipynb, cell 4)."""
    return nn.Sequential(
        nn.Dropout(0.4),
        RegularisedLinear(n_features, 32),
        nn.ReLU(),
        batch_norm_units(32),
        nn.Dropout(0.2),
        RegularisedLinear(32, 16),
        nn.ReLU(),
        batch_norm_units(16),
        nn.Dropout(0.2),
        RegularisedLinear(16, n_classes),
    )


def last_state(lstm: nn.LSTM, of_frames: Tensor) -> Tensor:
    """Return the last state (batch, unit) of LSTMs that go through (batch, frame, feature).

    On a CPU that has no LSTM in bfloat16 it is computed in float32, whatever the rest of the
    network is in: it is a small part of the work.
    """
    apart = torch.is_autocast_enabled("cpu") and not takes_bfloat16()
    with torch.autocast("cpu", enabled=False) if apart else nullcontext():
        last: Tensor = lstm(of_frames.float() if apart else of_frames)[0][:, -1]
    return last

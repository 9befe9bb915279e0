"""The network of the spatial encoding: one tactile image, SA-I or RA-I (SA-SE, RA-SE).

Pestell & Lepora, J. R. Soc. Interface 2022, section 2.4.1; layers as in the authors' code,
spatial/train_static.ipynb, cell 4 (commit 880f9e4).
"""

from typing import Self

from torch import Tensor, nn

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.models.base import Network, Task
from afferents.models.layers import (
    FlattenChannelsLast,
    RegularisedLinear,
    batch_norm_maps,
    batch_norm_units,
    initialise_like_keras,
)

SMALLEST_SIDE = 8
"""Rows and columns that leave at least one value a channel after the image stack."""
IMAGE_CHANNELS = 128


class SpatialNet(Network):
    """Texture from one tactile image: three convolutions and two dense layers.

    ========================  =================  ==========
    layer (ReLU after each)   output at 19 x 19  parameters
    ========================  =================  ==========
    Conv 64, 3 x 3, same      19 x 19 x 64              640
    MaxPool 2                 9 x 9 x 64
    BatchNorm                 9 x 9 x 64                256
    Conv 128, 3 x 3, same     9 x 9 x 128            73,856
    BatchNorm                 9 x 9 x 128               512
    Conv 128, 3 x 3, valid    7 x 7 x 128           147,584
    BatchNorm                 7 x 7 x 128               512
    MaxPool 2                 3 x 3 x 128
    BatchNorm                 3 x 3 x 128               512
    Flatten, Dropout 0.4      1152
    Dense 32, L2              32                     36,896
    BatchNorm, Dropout 0.4    32                        128
    Dense 16, L2              16                        528
    BatchNorm, Dropout 0.2    16                         64
    Dense 13, L2              13                        221
    ========================  =================  ==========

    Together 261,709, of which 260,717 are trainable, as Keras counts.

    Deviations: the output are logits, the softmax is in the loss and in prediction; rows and
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
    takes = (dims.ROW, dims.COLUMN)

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples (row, column)."""
        return cls(task.n_classes, *task.sample_shape)

    def __init__(self, n_classes: int, n_rows: int = 19, n_columns: int = 19) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        self.image = image_stack()
        self.dense = nn.Sequential(
            nn.Dropout(0.4),
            RegularisedLinear(image_features(n_rows, n_columns), 32),
            nn.ReLU(),
            batch_norm_units(32),
            nn.Dropout(0.4),
            RegularisedLinear(32, 16),
            nn.ReLU(),
            batch_norm_units(16),
            nn.Dropout(0.2),
            RegularisedLinear(16, n_classes),
        )
        initialise_like_keras(self)

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
        batch_norm_maps(64),
        nn.Conv2d(64, 128, 3, padding=1),
        nn.ReLU(),
        batch_norm_maps(128),
        nn.Conv2d(128, IMAGE_CHANNELS, 3),
        nn.ReLU(),
        batch_norm_maps(128),
        nn.MaxPool2d(2),
        batch_norm_maps(128),
        FlattenChannelsLast(),
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
            "tactile images",
            f"at least {SMALLEST_SIDE} x {SMALLEST_SIDE} markers for this network",
            f"{n_rows} x {n_columns}",
        )
    height, width = ((side // 2 - 2) // 2 for side in (n_rows, n_columns))
    return height * width * IMAGE_CHANNELS

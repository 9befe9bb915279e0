"""The network of the spectral encoding: vibration spectra (vib-TE).

Pestell & Lepora, J. R. Soc. Interface 2022, section 2.4.3; layers as in the authors' code,
vibrotactile/train_vibration.ipynb, cell 4 (commit 880f9e4).
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
    initialise_like_keras,
)

SMALLEST_SPECTRUM = 135
"""Bins that leave at least one value a channel after three poolings by 3 and the last kernel."""
CHANNELS = 128


class VibrationNet(Network):
    """Texture from a vibration spectrum: four one-dimensional convolutions and a dense layer.

    ==========================  ==================  ==========
    layer                       output at 200 bins  parameters
    ==========================  ==================  ==========
    Conv 128, 5, same, ReLU     200 x 128                  768
    MaxPool 3                   66 x 128
    BatchNorm                   66 x 128                   512
    Conv 128, 5, same, ReLU     66 x 128                82,048
    BatchNorm                   66 x 128                   512
    MaxPool 3                   22 x 128
    Conv 128, 5, same, ReLU     22 x 128                82,048
    BatchNorm                   22 x 128                   512
    MaxPool 3                   7 x 128
    Conv 128, 5, valid, ReLU    3 x 128                 82,048
    BatchNorm                   3 x 128                    512
    Flatten, Dropout 0.4        384
    Dense 32, ReLU, L2          32                      12,320
    Dense 13                    13                         429
    ==========================  ==================  ==========

    Together 261,709, of which 260,685 are trainable, as Keras counts (that `SpatialNet` has
    the same total is a coincidence). With 16 vibration channels 271,309.

    Deviations: the output are logits. The convolutions are written in two dimensions with a
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
    takes = (dims.CHANNEL, dims.FREQUENCY)

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples (channel, frequency)."""
        return cls(task.n_classes, *task.sample_shape)

    def __init__(self, n_classes: int, n_channels: int = 1, n_frequencies: int = 200) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        if n_frequencies < SMALLEST_SPECTRUM:
            raise InputError(
                "spectra",
                f"at least {SMALLEST_SPECTRUM} bins for this network",
                f"{n_frequencies}",
                "pad the windows with zeros before the Fourier transform",
            )
        self.spectrum = nn.Sequential(
            _convolution(n_channels, "same"),
            nn.MaxPool2d((1, 3)),  # before its ReLU, with which it commutes: less work
            nn.ReLU(),
            batch_norm_maps(CHANNELS),
            _convolution(CHANNELS, "same"),
            nn.ReLU(),
            batch_norm_maps(CHANNELS),
            nn.MaxPool2d((1, 3)),
            _convolution(CHANNELS, "same"),
            nn.ReLU(),
            batch_norm_maps(CHANNELS),
            nn.MaxPool2d((1, 3)),
            _convolution(CHANNELS, "valid"),
            nn.ReLU(),
            batch_norm_maps(CHANNELS),
            FlattenChannelsLast(),
        )
        self.dense = nn.Sequential(
            nn.Dropout(0.4),
            RegularisedLinear((n_frequencies // 27 - 4) * CHANNELS, 32),
            nn.ReLU(),
            nn.Linear(32, n_classes),
        )
        initialise_like_keras(self)

    def features(self, spectra: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, feature).

        Of spectra (batch, channel, frequency).
        """
        features: Tensor = self.spectrum(spectra.unsqueeze(2))
        return features


def _convolution(n_channels: int, padding: str) -> nn.Conv2d:
    return nn.Conv2d(n_channels, CHANNELS, (1, 5), padding=(0, 2 if padding == "same" else 0))

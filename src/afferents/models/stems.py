"""One network with a stem for each kind of afferent: the paper's networks, joined. Ours."""

from math import prod
from typing import Self

import torch
from torch import Tensor, nn

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.models.base import Network, Task
from afferents.models.cnn_lstm import UNITS, CnnLstm, dense_layers, last_state
from afferents.models.layers import initialise_like_keras
from afferents.models.vibration import VibrationNet


class ThreeStems(Network):
    """Texture from a window of vibration, a run of SA-I and a run of RA-I images together.

    The stems are the layers of `VibrationNet` and of two `CnnLstm` up to their dense layers; these
    three are one here, after what all stems make of a touch:

    ============================  ==============
    layer                         output
    ============================  ==============
    stem of vibration             384
    stems of SA-I and RA-I        10 each
    Dropout 0.4, Dense 32, L2     32
    BatchNorm, Dropout 0.2        32
    Dense 16, L2                  16
    BatchNorm, Dropout 0.2        16
    Dense, L2                     textures
    ============================  ==============

    Parameters
    ----------
    n_classes
        Number of textures.
    shapes
        Of a spectrum (channel, frequency), and of the two runs (frame, row, column), in the order
        in which they stand in a sample.

    Raises
    ------
    InputError
        If a spectrum is too short, or images are too small.
    """

    name, recipe = "three-stems", "cnn-lstm"
    takes = (dims.FEATURE,)
    deployable = False

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one for samples (feature), whose encoding says what `shapes` stand in them."""
        shapes = getattr(task.encoding, "shapes", ())
        if [len(shape) for shape in shapes] != [2, 3, 3]:
            expected = "a spectrum and two runs of images"
            raise InputError("the classifier three-stems", expected, f"samples {shapes}")
        return cls(task.n_classes, *shapes)

    def __init__(
        self,
        n_classes: int,
        spectrum: tuple[int, ...],
        slow: tuple[int, ...],
        fast: tuple[int, ...],
    ) -> None:
        """Build the layers and draw the weights."""
        super().__init__()
        self.shapes = (spectrum, slow, fast)
        vibration = VibrationNet(n_classes, *spectrum)
        self.spectrum = vibration.spectrum
        runs = [CnnLstm(n_classes, *shape[1:]) for shape in (slow, fast)]
        self.images = nn.ModuleList(run.image for run in runs)
        self.lstms = nn.ModuleList(run.lstm for run in runs)
        first = vibration.dense[1]
        assert isinstance(first, nn.Linear)
        self.dense = dense_layers(first.in_features + len(runs) * UNITS, n_classes)
        initialise_like_keras(self)

    def features(self, touches: Tensor) -> Tensor:
        """Return what enters the dense layers, (batch, 404), of touches (batch, feature)."""
        sizes = [prod(shape) for shape in self.shapes]
        spectrum, *runs = (
            part.reshape(len(part), *shape)
            for part, shape in zip(torch.split(touches, sizes, dim=1), self.shapes, strict=True)
        )
        found = [self.spectrum(spectrum.unsqueeze(2))]
        for image, lstm, run in zip(self.images, self.lstms, runs, strict=True):
            assert isinstance(lstm, nn.LSTM)
            of_frames = image(run.flatten(0, 1).unsqueeze(1)).unflatten(0, run.shape[:2])
            found.append(last_state(lstm, of_frames))
        return torch.cat(found, dim=1)

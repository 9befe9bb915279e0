"""A trained network or ridge made ready to feel with: calibrated probabilities, and 'unknown'.

A sample is unknown if its novelty (`models/novelty.py`), measured on a network's last features or
on a ridge's scores, is above 1.
"""

from typing import cast

import torch
from torch import Tensor, nn

from afferents.models.base import Classifier
from afferents.models.cnn_lstm import CnnLstm
from afferents.models.novelty import Novelty


class Deployed(nn.Module):
    """Probabilities and novelty of samples.

    Parameters
    ----------
    network
        A classifier that has learnt.
    n_classes
        Number of textures.
    scale
        Samples are divided by it.
    """

    temperature: Tensor

    def __init__(self, network: Classifier, n_classes: int, scale: float) -> None:
        """Start with temperature 1, and nothing known."""
        super().__init__()
        self.network = network
        self.scale = scale
        self.register_buffer("temperature", torch.ones(()))
        self.novelty = Novelty(n_classes, network.n_last)

    def forward(self, samples: Tensor) -> tuple[Tensor, Tensor]:
        """Return probabilities (batch, n_classes) and novelty (batch,)."""
        return self.outcome(self.last_features(samples))

    def last_features(self, samples: Tensor) -> Tensor:
        """Return what the scores are worked out of, (batch, feature)."""
        return self.network.last_features(samples * (1 / self.scale))

    def outcome(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Return probabilities and novelty of last features."""
        scores = self.network.scores_of(features)
        novelty = self.novelty(scores if self.network.novelty_of_scores else features)
        return (scores / self.temperature).softmax(1), novelty

    @torch.no_grad()
    def fit_novelty(self, features: Tensor, labels: Tensor, unseen: Tensor) -> None:
        """Learn what is known from last features of training samples, and of unseen ones the limit.

        Parameters
        ----------
        features, labels
            Of training samples, (n, feature) and (n,).
        unseen
            Last features of samples that were not learnt from, (m, feature).
        """
        network = self.network
        learnt, held = (
            network.scores_of(f) if network.novelty_of_scores else f for f in (features, unseen)
        )
        self.novelty.fit(learnt, labels, held)


class Stepping(nn.Module):
    """A deployed CNN-LSTM frame by frame: what the image stack made of earlier frames is kept.

    The same as `Deployed` on the run, a tenth of the work.
    """

    def __init__(self, deployed: Deployed) -> None:
        """Take over a deployed CNN-LSTM."""
        super().__init__()
        self.deployed = deployed

    def forward(self, image: Tensor, past: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return probabilities, novelty, and `past` for the next frame.

        Parameters
        ----------
        image
            (1, row, column).
        past
            Features of the frames before it, (1, n_frames - 1, feature).
        """
        whole, network = self.deployed, cast("CnnLstm", self.deployed.network)
        newest = network.image((image * (1 / whole.scale)).unsqueeze(1))
        of_frames = torch.cat([past, newest.unsqueeze(1)], 1)
        last: Tensor = network.dense[:-1](network.after(of_frames))
        probabilities, novelty = whole.outcome(last)
        return probabilities, novelty, of_frames[:, 1:]

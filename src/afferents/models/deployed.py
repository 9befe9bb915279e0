"""A trained model made ready to recognise: calibrated probabilities, and the novelty of samples."""

from typing import NamedTuple, cast

import numpy as np
import torch
import xarray as xr
from torch import Tensor, nn

from afferents import channels, dims
from afferents.encodings.samples import Samples, speeds_told
from afferents.encodings.settings import read_encoding
from afferents.errors import InputError
from afferents.models import base, networks
from afferents.models.card import Card, require_unit

KNOWN = 0.95
"""Share of samples, of textures known at a speed not learnt from, whose novelty is below 1."""
_RIDGE = 1e-2
"""Share of the mean variance that is added to the covariance: dead features have none."""
_LEAST_VARIANCE = 1e-12
"""Where no class varies, as with one sample of each: then all else is far."""
_BATCH = 256


class Novelty(nn.Module):
    """How far a sample lies from all that was learnt: the way a model says 'none of these'.

    Novelty is the smallest Mahalanobis distance to a class's mean, with one covariance for all
    classes (Lee et al., NeurIPS 2018), over the distance that few known samples exceed. Above 1
    nothing that was learnt fits.

    It is taken where textures lie apart most: of a network in its last features, of a ridge in its
    scores of the textures. That was chosen on a tuning session, by the area under the ROC curve:
    the ridge's values themselves, distances relative to that of all textures together (Ren et al.,
    2021), and the largest probability were each worse.

    Parameters
    ----------
    n_classes, n_features
        Number of textures, and of values a sample; scores of the textures are as many as these.
    """

    means: Tensor
    whitening: Tensor
    limit: Tensor

    def __init__(self, n_classes: int, n_features: int) -> None:
        """Start with nothing known."""
        super().__init__()
        self.register_buffer("means", torch.zeros(n_classes, n_features))
        self.register_buffer("whitening", torch.eye(n_features))
        self.register_buffer("limit", torch.ones(()))

    def forward(self, values: Tensor) -> Tensor:
        """Return the novelty (n,) of values (n, feature); above 1 is unknown."""
        return self.distance(values) / self.limit

    def distance(self, values: Tensor) -> Tensor:
        """Return the smallest Mahalanobis distance (n,) of values (n, feature) to a class."""
        off = (values.unsqueeze(1) - self.means) @ self.whitening
        return off.square().sum(2).min(1).values.sqrt()

    @torch.no_grad()
    def fit(self, values: Tensor, labels: Tensor, unseen: Tensor) -> None:
        """Learn what is known from training samples, and of unseen ones the limit; in place.

        Parameters
        ----------
        values, labels
            Of training samples, (n, feature) and (n,); no class may be without any.
        unseen
            Values of samples that were not learnt from, (m, feature): `KNOWN` of them are below 1.
        """
        self.means = torch.stack([values[labels == c].mean(0) for c in range(len(self.means))])
        within = (values - self.means[labels]).double()
        covariance = within.T @ within / len(within)
        variance = covariance.diagonal().mean().clamp_min(_LEAST_VARIANCE)
        ridge = _RIDGE * variance * torch.eye(len(covariance))
        # A factor of the inverse of the covariance that all classes share.
        self.whitening = torch.linalg.cholesky(torch.linalg.inv(covariance + ridge)).float()
        self.limit = torch.quantile(self.distance(unseen), KNOWN)


class Deployed(nn.Module):
    """Probabilities and novelty of samples; above 1 a sample is unknown.

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

    def __init__(self, network: base.Classifier, n_classes: int, scale: float) -> None:
        """Start with temperature 1, and nothing known."""
        super().__init__()
        self.network = network
        self.scale = scale
        self.register_buffer("temperature", torch.ones(()))
        n_values = n_classes
        if not network.novelty_of_scores:
            n_values = cast("nn.Linear", cast("base.Network", network).dense[-1]).in_features
        self.novelty = Novelty(n_classes, n_values)

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
        whole, network = self.deployed, cast("networks.CnnLstm", self.deployed.network)
        newest = network.image((image * (1 / whole.scale)).unsqueeze(1))
        of_frames = torch.cat([past, newest.unsqueeze(1)], 1)
        last: Tensor = network.dense[:-1](networks.last_state(network.lstm, of_frames))
        probabilities, novelty = whole.outcome(last)
        return probabilities, novelty, of_frames[:, 1:]


class Recogniser(NamedTuple):
    """A trained model that recognises texture in samples.

    Attributes
    ----------
    card
        What the model is, what it learnt from, and how far it was tested.
    """

    card: Card
    deployed: Deployed

    @torch.no_grad()
    def predict(self, samples: Samples) -> xr.Dataset:
        """Return how probable each texture is for samples, and how novel these are.

        Parameters
        ----------
        samples
            As `afferents.samples` returns them for the card's channel and encoding, (sample, ...).

        Returns
        -------
        xarray.Dataset
            `probability (sample, texture)`, rows sum to 1; `novelty (sample)`, above 1 where a
            sample is unlike all that was learnt from; `speed_outside (sample)`, whether the
            sample's speed is known and slower or faster than all that was learnt from: novelty
            means nothing there, for known textures are novel too; and the coordinates of the
            samples.

        Raises
        ------
        InputError
            If a sample has another form than those that the model learnt from, or is marked as
            of another channel, or of cells and not of markers.
        """
        if dims.CHANNEL in samples.attrs:
            require_unit(self.card, bool(samples.attrs.get(dims.CELLS)), "samples")
        seen = read_encoding(self.card.encoding, "the card").seen(samples.values)
        if seen.shape[1:] != self.card.shape:
            raise InputError(
                f"samples: expected (sample, ...) of the form {self.card.shape}, as the model "
                f"learnt from, found {samples.shape[1:]}; encode {self.card.channel} as the "
                "card's 'encoding' says"
            )
        learnt = channels.find_channel(self.card.channel).name
        if (found := samples.attrs.get(dims.CHANNEL, learnt)) != learnt:
            raise InputError(f"samples: expected some of {learnt}, found some of {found}")
        learnt_mm_s = self.card.learnt_from_mm_s
        outside = np.zeros(len(samples), dtype=bool)
        if dims.SPEED in samples.coords and learnt_mm_s:
            speed = speeds_told(samples)
            outside = (speed < min(learnt_mm_s)) | (speed > max(learnt_mm_s))
        values = torch.as_tensor(seen, dtype=torch.float32)
        outcomes = [self.deployed(batch) for batch in torch.split(values, _BATCH)]
        probability, novelty = (torch.cat(parts).numpy() for parts in zip(*outcomes, strict=True))
        of_samples = {
            str(name): coordinate
            for name, coordinate in samples.coords.items()
            if coordinate.dims == (dims.SAMPLE,) and name != dims.TEXTURE
        }
        return xr.Dataset(
            {"probability": ((dims.SAMPLE, dims.TEXTURE), probability),
             "novelty": (dims.SAMPLE, novelty),
             "speed_outside": (dims.SAMPLE, outside)},
            {**of_samples, dims.TEXTURE: list(self.card.textures)},
        )  # fmt: skip

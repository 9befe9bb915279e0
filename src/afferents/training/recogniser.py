"""A trained model that is asked from Python."""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import torch
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.card import Card
from afferents.core.errors import InputError
from afferents.core.samples import Samples
from afferents.models import Deployed
from afferents.training.model_folder import load_model

_BATCH = 256


@dataclass(frozen=True, eq=False)
class Recogniser:
    """A trained model, ready to be asked what it feels.

    Attributes
    ----------
    card
        What the model is, what it learnt from, and how far it was tested.
    """

    card: Card
    deployed: Deployed

    @classmethod
    def of_folder(cls, folder: Path) -> Self:
        """Read the model that is in a folder; see `training.model_folder.load_model`."""
        return cls(*load_model(folder))

    @torch.no_grad()
    def predict(self, samples: Samples) -> xr.Dataset:
        """Return what samples feel like.

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
            says nothing there, for known textures are novel too; and the coordinates of the
            samples.

        Raises
        ------
        InputError
            If a sample has another form than those that the model learnt from.
        """
        if samples.shape[1:] != self.card.shape:
            raise InputError(
                "samples", f"(sample, ...) of the form {self.card.shape}, as the model learnt from",
                f"{samples.shape[1:]}", f"encode {self.card.channel} as the card's 'encoding' says",
            )  # fmt: skip
        values = torch.as_tensor(samples.values, dtype=torch.float32)
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
             "speed_outside": (dims.SAMPLE, self._outside(samples))},
            {**of_samples, dims.TEXTURE: list(self.card.textures)},
        )  # fmt: skip

    def _outside(self, samples: Samples) -> NDArray[np.bool_]:
        """Return which samples are known to be slower or faster than all that was learnt from."""
        learnt = self.card.learnt_from_mm_s
        if dims.SPEED not in samples.coords or not learnt:
            return np.zeros(len(samples), dtype=bool)
        speed = samples[dims.SPEED].values
        return np.asarray((speed < min(learnt)) | (speed > max(learnt)))

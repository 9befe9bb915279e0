"""Samples that are gathered a batch at a time."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Data:
    """All samples and their labels, and what is done to a batch of them.

    Attributes
    ----------
    values
        Float32, shape (n_samples, *sample_shape); stays where the caller put it.
    labels
        Int64, shape (n_samples,).
    scale
        A batch is divided by it.
    device
        A batch is sent there.
    """

    values: Tensor
    labels: Tensor
    scale: float
    device: torch.device

    def batch(self, index: Tensor) -> tuple[Tensor, Tensor]:
        """Return the samples, scaled, and the labels of an index tensor, on the device."""
        return gather(self.values, index, self.scale, self.device), (
            self.labels.index_select(0, index).to(self.device)
        )


def gather(values: Tensor, index: Tensor, scale: float, device: torch.device) -> Tensor:
    """Return a scaled copy of some samples on the device."""
    return values.index_select(0, index).mul_(1 / scale).to(device)


def split(order: Tensor, batch_size: int) -> list[Tensor]:
    """Cut indices into batches; the last keeps the rest, and one left alone joins the one before.

    Batch normalisation has no variance of a single sample.
    """
    batches = list(torch.split(order, batch_size))
    if len(batches) > 1 and len(batches[-1]) == 1:
        batches[-2:] = [torch.cat(batches[-2:])]
    return batches

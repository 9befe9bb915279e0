"""Samples that are gathered a batch at a time."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor


@dataclass(frozen=True)
class Data:
    """All samples and their labels, and what is done to a batch of them.

    Attributes
    ----------
    values
        Float32, shape (n_samples, *sample_shape).
    labels
        Int64, shape (n_samples,).
    scale
        A batch is divided by it.
    """

    values: Tensor
    labels: Tensor
    scale: float

    def on(self, device: torch.device) -> "Data":
        """Return them on a device: a GPU holds all of them, on the CPU nothing is copied."""
        return replace(self, values=self.values.to(device), labels=self.labels.to(device))

    def batch(self, index: Tensor) -> tuple[Tensor, Tensor]:
        """Return the samples, scaled, and the labels of an index tensor, where they lie."""
        return gather(self.values, index, self.scale), self.labels.index_select(0, index)


def gather(values: Tensor, index: Tensor, scale: float) -> Tensor:
    """Return a scaled copy of some samples."""
    return values.index_select(0, index).mul_(1 / scale)


def split(order: Tensor, batch_size: int) -> list[Tensor]:
    """Cut indices into batches; the last keeps the rest, and one left alone joins the one before.

    Batch normalisation has no variance of a single sample.
    """
    batches = list(torch.split(order, batch_size))
    if len(batches) > 1 and len(batches[-1]) == 1:
        batches[-2:] = [torch.cat(batches[-2:])]
    return batches

"""Samples that are gathered a batch at a time."""

import torch
from torch import Tensor


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

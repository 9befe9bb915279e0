"""What textures samples of groups not learnt from are taken for: a discriminant, solved from sums.

Quick, for every group's sums are made once. Nothing is chosen on the data that are asked.
"""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from afferents.models import Gram, equal_weights, sum_of

SHRINKAGE = 0.1
"""Of the discriminant's covariance; see `models.Discriminant`.

Fixed after 0.001 to 10 had been tried at held-out speeds of one simulated session.
"""

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]


def named_when_left_out(
    values: Floats, labels: Indices, groups: Indices, columns: Sequence[Indices]
) -> list[Indices]:
    """Return what samples are taken for by discriminants that have not learnt from their group.

    Parameters
    ----------
    values
        (n, feature).
    labels, groups
        Numbers of textures and of groups, such as speeds, (n,).
    columns
        Which features each discriminant learns from.

    Returns
    -------
    For each, the numbers of textures, (n,).
    """
    x, n_classes = torch.from_numpy(values), int(labels.max()) + 1
    at = [np.flatnonzero(groups == group) for group in np.unique(groups)]
    sums = [_sums(x[index], torch.from_numpy(labels[index]), n_classes) for index in at]
    found = [np.empty(len(values), np.int64) for _ in columns]
    for number, index in enumerate(at):
        learnt = sum_of([its for other, its in enumerate(sums) if other != number])
        for named, own in zip(found, columns, strict=True):
            features = torch.from_numpy(own)
            weight, constant = learnt.of(features).solve_as_discriminant(SHRINKAGE)
            named[index] = (x[index][:, features] @ weight + constant).argmax(1).numpy()
    return found


def _sums(x: torch.Tensor, labels: torch.Tensor, n_classes: int) -> Gram:
    """Return the sums of one group's samples, in which every texture counts the same."""
    gram = Gram(x.shape[1], n_classes)
    weight = equal_weights(labels, torch.zeros(len(labels)))
    gram.add(x, nn.functional.one_hot(labels, n_classes), weight)
    return gram

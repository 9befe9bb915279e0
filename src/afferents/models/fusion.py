"""Fusion: what several models of one touch say together.

A late fusion weighs the log-probabilities of its parts; a joint one is a ridge on the values of
all of them. What they learn on a fold is in `training.solved`.
"""

from typing import Self

import torch
from torch import nn

from afferents.models.base import Classifier, Task
from afferents.models.ridge import Ridge


class LateFusion(Classifier):
    """The models of the parts, and how much each counts.

    Parameters
    ----------
    parts
        By the name of their model, learnt already.
    weights
        How often each one's log-probabilities count.
    """

    name = "late-fusion"
    deployable = False
    learns_parts = True

    def __init__(self, parts: dict[str, Classifier], weights: list[float]) -> None:
        """Take the parts."""
        super().__init__()
        self.parts = nn.ModuleDict(parts)
        self.register_buffer("weights", torch.tensor(weights))

    @classmethod
    def built_for(cls, task: Task) -> Self:
        """Return one without parts."""
        return cls({}, [])


class MeanFusion(LateFusion):
    """Networks of the parts, each learnt alone, whose log-probabilities count the same."""

    name = "mean-fusion"


class JointFusion(Ridge):
    """One ridge on the values of all parts."""

    name = "joint-fusion"
    deployable = False
    learns_from_sums = False

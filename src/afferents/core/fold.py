"""A fold: which samples train, validate and test one group held out, by default a speed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents.core.split import SPEED, Group, Split

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Fold:
    """Indices of the samples that train, validate and test one group held out.

    Attributes
    ----------
    held_out, validated_by
        The group that is tested, and the one that validates (the same under `published`).
    split
        What the groups are.
    """

    held_out: Group
    validated_by: Group
    train: Indices
    validation: Indices
    test: Indices
    split: Split = SPEED

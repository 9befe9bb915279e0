"""A fold: which samples train, validate and test one held-out speed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Fold:
    """Indices of the samples that train, validate and test one held-out speed."""

    held_out_mm_s: float
    validation_mm_s: float
    train: Indices
    validation: Indices
    test: Indices

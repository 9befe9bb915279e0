"""How far two arrays that should be one are apart, over many recordings or folds."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class Difference:
    """Differences of one stage, taken together.

    Attributes
    ----------
    stage
        What is compared, such as SA-I.
    unit
        Of the numbers.
    n
        How many numbers were compared; those that are missing here (NaN) are not among them.
    largest, where
        The largest difference, and the recording or fold that has it.
    """

    stage: str
    unit: str
    n: int = 0
    missing: int = 0
    largest: float = 0.0
    where: str = ""
    _sum: float = 0.0

    def add(
        self, ours: NDArray[np.floating], theirs: NDArray[np.floating], where: str
    ) -> "Difference":
        """Take in two arrays of one shape; return itself."""
        apart = np.abs(ours.astype(np.float64) - theirs)
        there = np.isfinite(apart)
        self.missing += int(apart.size - there.sum())
        self.n += int(there.sum())
        self._sum += float(apart[there].sum())
        largest = float(apart.max(initial=0.0, where=there))
        if not self.where or largest > self.largest:
            self.largest, self.where = largest, where
        return self

    @property
    def mean(self) -> float:
        """Mean difference."""
        return self._sum / self.n if self.n else 0.0

    def describe(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "stage": self.stage,
            "unit": self.unit,
            "compared": self.n,
            "missing": self.missing,
            "largest": self.largest,
            "mean": self.mean,
            "where": self.where,
        }

"""How sure an accuracy is, and the difference of two, by bootstrap over recordings and seeds."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.split import Group, column_of, group_in, order

RESAMPLES = 2000

Counts = NDArray[np.float64]
"""Shape (recording, seed, 2): test samples named rightly, and all."""


@dataclass(frozen=True)
class Interval:
    """A 95% interval."""

    low: float
    high: float


@dataclass(frozen=True)
class Difference:
    """How much more accurate one is than another, and the 95% interval of that."""

    mean: float
    low: float
    high: float

    def describe(self) -> dict[str, Any]:
        """Return it as the summary holds it."""
        return {"difference": self.mean, "ci95": [self.low, self.high]}


def count_right(predictions: pd.DataFrame) -> pd.DataFrame:
    """Count the test samples of each recording and seed that were named rightly, and all.

    Parameters
    ----------
    predictions
        Columns held_out_speed_mm_s (or held_out_group), recording, seed (may be missing for one),
        true_texture and predicted_texture; one row a test sample.

    Returns
    -------
    DataFrame
        Columns held_out_speed_mm_s (or held_out_group), recording, seed, right and n.
    """
    held_out = column_of(predictions)
    rows = pd.DataFrame(
        {
            held_out: predictions[held_out],
            "recording": predictions["recording"].astype(str),
            "seed": predictions.get("seed", 0),
            "right": predictions["true_texture"] == predictions["predicted_texture"],
        }
    )
    right = rows.groupby([held_out, "recording", "seed"])["right"]
    return right.agg(right="sum", n="count").reset_index()


class Accuracy:
    """Accuracies of one model under one protocol, by group held out, recording and seed.

    Samples of one recording are anything but independent, and so are the predictions of one
    training: both are drawn anew, whole, recordings and seeds each with replacement within each
    group held out. The groups are those of the experiment and stay.

    Parameters
    ----------
    predictions
        As `count_right` takes them.
    """

    def __init__(self, predictions: pd.DataFrame) -> None:
        """Count once what is drawn from often."""
        self._take(count_right(predictions))

    @classmethod
    def of_counts(cls, counts: pd.DataFrame) -> "Accuracy":
        """Return the accuracies of samples that `count_right` has counted already."""
        found = object.__new__(cls)
        found._take(counts)
        return found

    def _take(self, counts: pd.DataFrame) -> None:
        self.counts: dict[Group, Counts] = {}
        self.recordings: dict[Group, list[str]] = {}
        for value, of_group in counts.groupby(column_of(counts)):
            group = group_in(value)
            cube = of_group.pivot_table(
                ["right", "n"], "recording", "seed", aggfunc="sum", fill_value=0
            )
            self.recordings[group] = [str(name) for name in cube.index]
            pair = [cube[counted].to_numpy(dtype=float) for counted in ("right", "n")]
            self.counts[group] = np.stack(pair, axis=-1)

    def of(self, recordings: dict[Group, list[str]]) -> "Accuracy":
        """Return the accuracies of these recordings alone."""
        part = object.__new__(Accuracy)
        part.recordings = recordings
        part.counts = {
            group: self.counts[group][[self.recordings[group].index(name) for name in names]]
            for group, names in recordings.items()
        }
        return part

    def mean(self) -> float:
        """Return the mean over the groups held out."""
        totals = [counts.sum(axis=(0, 1)) for counts in self.counts.values()]
        return float(np.mean([right / n for right, n in totals]))

    def resampled(self, seed: int = 0) -> NDArray[np.float64]:
        """Return `RESAMPLES` means over groups; the same seed draws the same recordings."""
        rng, of_seeds = np.random.default_rng(seed), np.random.default_rng([seed, 1])
        by_group = []
        for group in sorted(self.counts, key=order):
            counts = self.counts[group]
            n, n_seeds, _ = counts.shape
            recordings = rng.integers(0, n, (RESAMPLES, n))
            seeds = of_seeds.integers(0, n_seeds, (RESAMPLES, n_seeds))
            drawn = counts[recordings[:, :, None], seeds[:, None, :]].sum(axis=(1, 2))
            by_group.append(drawn[:, 0] / np.maximum(drawn[:, 1], 1))
        return np.asarray(np.mean(by_group, axis=0))


def bootstrap_interval(accuracy: Accuracy, seed: int = 0) -> Interval:
    """95% percentile interval of the mean over groups of the accuracy."""
    return interval_of(accuracy.resampled(seed))


def interval_of(drawn: NDArray[np.float64]) -> Interval:
    """Return the 95% percentile interval of what `Accuracy.resampled` has drawn, or made of it."""
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Interval(float(low), float(high))


def paired_difference(one: Accuracy, other: Accuracy, seed: int = 0) -> Difference:
    """Compare two models, or protocols, on the recordings that both were tested on.

    Each draw takes the same recordings for both, so what makes a recording hard for either
    cancels; seeds are paired by their order.

    Raises
    ------
    InputError
        If they have no recording of a group held out in common.
    """
    common = {
        group: [name for name in names if name in set(other.recordings[group])]
        for group, names in one.recordings.items()
        if group in other.recordings
    }
    common = {group: names for group, names in common.items() if names}
    if not common:
        raise InputError("a comparison", "recordings that both were tested on", "none")
    a, b = one.of(common), other.of(common)
    interval = interval_of(a.resampled(seed) - b.resampled(seed))
    return Difference(a.mean() - b.mean(), interval.low, interval.high)

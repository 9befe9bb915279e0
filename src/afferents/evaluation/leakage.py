"""What of the group held out, by default a speed, was seen before the final test."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import LeakageError
from afferents.core.fold import Fold, Indices
from afferents.core.samples import Samples
from afferents.core.split import Split


@dataclass(frozen=True)
class Leaks:
    """Counts over the test samples of a fold; all zero and False where nothing leaks."""

    test_samples_of_a_group_seen_in_training: int
    test_samples_of_a_group_seen_in_validation: int
    test_samples_overlapping_training: int
    test_samples_overlapping_validation: int
    scale_saw_held_out_group: bool

    def describe(self, split: Split) -> dict[str, Any]:
        """Return them by name; of the default split a group is called a speed."""
        return {name.replace("group", split.leaks): n for name, n in asdict(self).items()}

    def __bool__(self) -> bool:
        """Whether anything leaks."""
        return any(asdict(self).values())


def find_leaks(samples: Samples, fold: Fold, scaled_on: Indices) -> Leaks:
    """Count the leaks of a fold.

    Parameters
    ----------
    samples
        All samples, with their groups, recordings and extents in time.
    scaled_on
        Indices of the samples from which the scaling constant was taken, empty if none.
    """
    groups = fold.split.of(samples)
    tested = groups[fold.test]
    return Leaks(
        int(np.isin(tested, groups[fold.train]).sum()),
        int(np.isin(tested, groups[fold.validation]).sum()),
        overlapping(samples, fold.test, fold.train),
        overlapping(samples, fold.test, fold.validation),
        bool(np.isin(tested, groups[scaled_on]).any()),
    )


def refuse_leaks(leaks: Leaks, fold: Fold) -> None:
    """Raise if anything of the group held out was seen.

    Raises
    ------
    LeakageError
        Naming the kinds of leak.
    """
    if leaks:
        named = leaks.describe(fold.split)
        kinds = ", ".join(f"{name} {value}" for name, value in named.items() if value)
        raise LeakageError(
            f"held-out {fold.split.named(fold.held_out)}: expected nothing of it seen before the "
            f"test under the nested protocol, found {kinds}"
        )


def overlapping(samples: Samples, tested: Indices, others: Indices) -> int:
    """Count the tested samples that share a moment of a recording with one of the others."""
    recordings = samples[dims.RECORDING].values
    starts, stops = samples[dims.START].values, samples[dims.STOP].values
    count = 0
    for recording in np.unique(recordings[tested]):
        mine = tested[recordings[tested] == recording]
        theirs = others[recordings[others] == recording]
        count += _overlaps(starts[mine], stops[mine], starts[theirs], stops[theirs])
    return count


def _overlaps(
    start: NDArray[np.float64],
    stop: NDArray[np.float64],
    other_start: NDArray[np.float64],
    other_stop: NDArray[np.float64],
) -> int:
    if len(other_start) == 0:
        return 0
    order = np.argsort(other_start)
    # Of the others that begin before a sample ends, does the one that lasts longest outlast
    # the sample's beginning?
    latest_stop = np.maximum.accumulate(other_stop[order])
    before = np.searchsorted(other_start[order], stop, side="left")
    reaching = np.where(before > 0, latest_stop[np.maximum(before - 1, 0)], -np.inf)
    return int((reaching > start).sum())

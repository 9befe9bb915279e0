"""Leave one group out, by default a speed: folds under either protocol, and what leaks in them."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from afferents import dims
from afferents.encodings.samples import Samples, concatenate
from afferents.errors import InputError, LeakageError
from afferents.folds.ablation import Ablation
from afferents.folds.held_out import SPEED, Group, Split, key_of, order
from afferents.folds.protocol import PROTOCOLS, Fold, Indices, Protocol


@dataclass
class LeaveOneGroupOut:
    """Hold out one group at a time, in turn.

    A random split would put neighbouring frames (11 ms apart) and overlapping windows on both
    sides and report memory as recognition; holding whole groups out prevents that bias: whole
    speeds, or trials, or whatever the split says. A recording is of one group.

    `split` is what scikit-learn calls, as in ``cross_val_score(..., groups=speeds, cv=self)``:
    all other groups train, since such estimators need no validation, and all of the held-out
    group is tested. `folds` sets validation samples aside, as the protocol says:

    ==============  ====================================  ======================================
    protocol        nested                                published
    ==============  ====================================  ======================================
    training        other groups but the validation's     all other groups
    validation      one whole training group              half of the held-out group
    test            all of the held-out group             the other half of it
    ==============  ====================================  ======================================

    The published halves are every second frame or window of a recording, even ones validating
    (process_static.ipynb, cell 5); with `random_halves`, as for spectra, window numbers drawn
    at random for each fold, the same for all textures (process_vibration.ipynb, cell 7). Where
    recordings have a single window each, every second recording of a texture takes its place.

    >>> trials = ["1", "1", "2", "2", "10", "10"]
    >>> for train, test in LeaveOneGroupOut().split(trials, groups=trials):
    ...     print(train, test)
    [2 3 4 5] [0 1]
    [0 1 4 5] [2 3]
    [0 1 2 3] [4 5]
    """

    protocol: Protocol = field(default_factory=lambda: PROTOCOLS["nested"])
    random_halves: bool = False
    seed: int = 0
    what: Split = SPEED

    def get_n_splits(self, X: Any = None, y: Any = None, groups: ArrayLike | None = None) -> int:  # noqa: N803
        """Return the number of groups."""
        return len(np.unique(groups_of_samples(groups)))

    def split(
        self,
        X: Any,  # noqa: N803
        y: Any = None,
        groups: ArrayLike | None = None,
    ) -> Iterator[tuple[Indices, Indices]]:
        """Yield (train, test) for each group in order; `groups` are the speeds, mm/s, or names.

        All other groups train; nothing is set aside for validation.

        Raises
        ------
        InputError
            If a sample has no group, or there is one group alone.
        """
        of = groups_of_samples(groups)
        for group in self._ranked(of):
            train = ~self.what.sharing(of, group)
            yield np.flatnonzero(train), np.flatnonzero(of == group)

    def folds(self, samples: Samples) -> Iterator[Fold]:
        """Yield the folds of `samples`, the groups held out in order.

        Raises
        ------
        InputError
            If there are too few groups (3 for `nested`, 2 for `published`), or none left to
            train on.
        """
        for group in self._ranked(self.what.of(samples)):
            yield self.fold(samples, group)[1]

    def fold(self, samples: Samples, held_out: Group) -> tuple[int, Fold]:
        """Return one of the folds, without the others, and its rank among them.

        Raises
        ------
        InputError
            As `folds`.
        """
        groups = self.what.of(samples)
        ranked = self._ranked(groups)
        rank = ranked.index(held_out)
        shares = self.what.sharing(np.array(ranked), held_out)
        apart = tuple(g for g, its in zip(ranked, shares, strict=True) if g == held_out or not its)
        validated_by = self.protocol.validation_group(apart, held_out, self.what)
        held = groups == held_out
        if validated_by == held_out:
            validating = self._validating_half(samples, held, rank)
            validation, test = held & validating, held & ~validating
        else:
            validation, test = groups == validated_by, held
        train = ~self.what.sharing(groups, held_out) & ~validation
        learnt, chosen_by, tested = map(np.flatnonzero, (train, validation, test))
        fold = Fold(held_out, validated_by, learnt, chosen_by, tested, self.what)
        return rank, fold

    def _ranked(self, groups: NDArray[Any]) -> tuple[Group, ...]:
        ranked = tuple(sorted(np.unique(groups).tolist(), key=order))
        if len(ranked) < 2:
            expected = f"at least 2 {self.what.many} to hold one out"
            raise InputError(f"the data: expected {expected}, found {len(ranked)}")
        return ranked

    def _validating_half(
        self, samples: Samples, held: NDArray[np.bool_], rank: int
    ) -> NDArray[np.bool_]:
        number = number_in_recording(samples[dims.RECORDING].values)
        if not number[held].any():
            number[held] = number_in_recording(samples[dims.TEXTURE].values[held])
        if not self.random_halves:
            return np.equal(number % 2, 0)
        n = int(number[held].max()) + 1
        drawn = np.random.default_rng([self.seed, rank]).permutation(n)[: n // 2]
        return np.isin(number, drawn)


class LeaveOneSpeedOut(LeaveOneGroupOut):
    """Hold out one speed at a time, which is what `LeaveOneGroupOut` does by default.

    >>> speeds = [10, 10, 20, 20, 30, 30]
    >>> for train, test in LeaveOneSpeedOut().split(speeds, groups=speeds):
    ...     print(train, test)
    [2 3 4 5] [0 1]
    [0 1 4 5] [2 3]
    [0 1 2 3] [4 5]
    """


def number_in_recording(recordings: NDArray[Any]) -> Indices:
    """Return each sample's running number within its recording, from 0, in order of time."""
    order = np.argsort(recordings, kind="stable")
    _, first, count = np.unique(recordings[order], return_index=True, return_counts=True)
    number = np.empty(len(recordings), dtype=np.int64)
    number[order] = np.arange(len(recordings)) - np.repeat(first, count)
    return number


def groups_of_samples(groups: ArrayLike | None) -> NDArray[Any]:
    """Return the groups of samples, (n_samples,): numbers, or texts where any is none.

    Raises
    ------
    InputError
        If there are none, they are no list, or one is missing.
    """
    if groups is None:
        raise InputError(
            "groups: expected the group of every sample, such as its speed, found none"
        )
    given = np.asarray(groups)
    if given.ndim != 1:
        raise InputError(
            f"groups: expected a list, one group a sample, found an array of shape {given.shape}"
        )
    of = pd.Series(given).infer_objects()
    if (missing := np.flatnonzero(of.isna())).size:
        raise InputError(
            f"groups: expected the group of every sample, found none for {missing.size} of "
            f"{len(of)}, the first at {missing[0]}; leave these samples out"
        )
    if not pd.api.types.is_numeric_dtype(of):
        return of.astype(str).to_numpy().astype(np.str_)
    numbers = of.to_numpy(float)
    if all(float(key_of(number)) == number for number in np.unique(numbers).tolist()):
        return numbers
    return np.array([f"{number:.15g}" for number in numbers.tolist()])  # days, as 20240131


def hold_out_the_middle(samples: Samples, split: Split = SPEED) -> Fold:
    """Return the fold that trains on all groups, by default speeds, but the middle one.

    The middle one validates; nothing is tested.

    Raises
    ------
    InputError
        If there is one group only, or a texture in the middle one alone.
    """
    group = split.of(samples)
    groups = sorted(np.unique(group).tolist(), key=order)
    if len(groups) < 2:
        expected = f"at least 2 {split.many}, one of them to validate with"
        raise InputError(f"the data: expected {expected}, found {len(groups)}")
    middle = groups[len(groups) // 2]
    learnt = np.flatnonzero(~split.sharing(group, middle))
    validation = np.flatnonzero(group == middle)
    texture = samples[dims.TEXTURE].values
    only_there = sorted(set(texture[validation]) - set(texture[learnt]))
    if only_there:
        found = f"none of {', '.join(map(str, only_there))}"
        expected = f"every texture at another {split.title} than {split.printed(middle)}"
        raise InputError(f"the data: expected {expected}, found {found}")
    return Fold(middle, middle, learnt, validation, np.empty(0, dtype=np.int64), split)


def join_variants(learnt: Samples, tested: Samples) -> Samples:
    """Return samples that are learnt from, then those that are tested, one array.

    The coordinate `variant` is 0 for what is learnt from, 1 for what is tested.
    """
    return concatenate([
        part.assign_coords({dims.VARIANT: (dims.SAMPLE, np.full(len(part), number))})
        for number, part in enumerate([learnt, tested])
    ])  # fmt: skip


def make_fold(
    splitter: LeaveOneGroupOut,
    samples: Samples,
    held_out: Group,
    ablation: Ablation,
    tested: frozenset[str],
) -> tuple[int, Fold]:
    """Return the fold of a held-out group, and its rank, with what an ablation leaves of it.

    Where samples come in variants (see `join_variants`), training samples are of one and test
    samples of the other.

    Parameters
    ----------
    tested
        Names of the recordings that alone are tested; none for all.
    """
    bounds = [0, len(samples)]
    if dims.VARIANT in samples.coords:
        bounds[1:1] = (np.flatnonzero(np.diff(samples[dims.VARIANT].values)) + 1).tolist()
    rank, folds = 0, []
    for start, stop in pairwise(bounds):
        part = samples.isel({dims.SAMPLE: slice(start, stop)})
        rank, fold = splitter.fold(part, held_out)
        fold = ablation.fold(fold, part, tested)
        folds.append(replace(fold, test=fold.test + start))
    return rank, replace(folds[0], test=folds[-1].test)


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


def find_leaks(samples: Samples, fold: Fold, scaled_on: Indices) -> Leaks:
    """Count the leaks of a fold.

    Parameters
    ----------
    samples
        All samples, with their groups, recordings and extents in time.
    scaled_on
        Indices of the samples from which the scaling constant was taken, empty if none.
    """
    shares = fold.split.sharing(fold.split.of(samples), fold.held_out)
    learnt, chosen, scaled = (
        bool(shares[index].any()) for index in (fold.train, fold.validation, scaled_on)
    )
    return Leaks(
        len(fold.test) * learnt,
        len(fold.test) * chosen,
        overlapping(samples, fold.test, fold.train),
        overlapping(samples, fold.test, fold.validation),
        scaled,
    )


def refuse_leaks(leaks: Leaks, fold: Fold) -> None:
    """Raise if anything of the group held out was seen.

    Raises
    ------
    LeakageError
        Naming the kinds of leak.
    """
    if kinds := [f"{name} {n}" for name, n in leaks.describe(fold.split).items() if n]:
        raise LeakageError(
            f"held-out {fold.split.named(fold.held_out)}: expected nothing of it seen before the "
            f"test under the nested protocol, found {', '.join(kinds)}"
        )


def overlapping(samples: Samples, tested: Indices, others: Indices) -> int:
    """Count the tested samples that share a moment of a recording with one of the others."""
    recordings = samples[dims.RECORDING].values
    starts, stops = samples[dims.START].values, samples[dims.STOP].values
    count = 0
    for recording in np.unique(recordings[tested]):
        mine = tested[recordings[tested] == recording]
        theirs = others[recordings[others] == recording]
        if not len(theirs):
            continue
        theirs = theirs[np.argsort(starts[theirs])]
        # Of the others that begin before a sample ends, does the one that lasts longest outlast
        # the sample's beginning?
        latest_stop = np.maximum.accumulate(stops[theirs])
        before = np.searchsorted(starts[theirs], stops[mine], side="left")
        reaching = np.where(before > 0, latest_stop[np.maximum(before - 1, 0)], -np.inf)
        count += int((reaching > starts[mine]).sum())
    return count

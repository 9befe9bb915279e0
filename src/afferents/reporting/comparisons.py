"""Tables that compare: each fold with the paper's, models, protocols, and runs."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from afferents.evaluation.options import shell_words
from afferents.evaluation.results import Difference, FirstEpoch, Outcome, Summary
from afferents.models.model import TABLE1
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    and_seeds,
    are_published,
    drawn_over,
    in_table_order,
    model_title,
    outcome,
    outcomes,
    percent,
)
from afferents.reporting.published import (
    PublishedFamily,
    PublishedFold,
    published_families,
    published_speeds,
    published_textures,
)
from afferents.reporting.tables import (
    OTHER_RECORDINGS,
    SAME_GRID,
    Cell,
    across_modalities,
    make_table,
    mean_and_interval,
)

# Each fold beside the paper's: accuracy, the epoch that was kept, and the first epoch.
#
# Only where textures and speeds are the paper's own: a fold of other speeds learnt from something
# else. A difference is marked where it is larger than the paper's own spread between folds would
# make likely; the rule is `spread_between_folds` and `likely`, and the table states it.

OTHERS = {
    "textures", "speeds", "train_speeds", "markers", "test_only", "without", "control", "disturb",
    "disturb_training",
}  # fmt: skip
"""Options with which folds learn from, or are tested on, something else than the paper's."""
LARGER = "yes"
"""What stands beside a difference that the spread does not make likely."""
_OTHER_LOG = "The paper's accuracies of SA-STE are not of the trainings that its log tells of. "
_RULE = (
    "The rule: each of the paper's folds is compared with the mean of its two neighbours in speed, "
    "which takes the trend with speed away; the root mean square of that, divided by √1.5, is the "
    "spread s of one training (points: {spreads}). Two trainings then differ by a "
    "standard deviation of √2 s, and a difference beyond twice that (2.8 s) is marked; "
    "for the mean over n folds, beyond 2.8 s / √n; where ours are means of k seeds, √(1 + 1/k) "
    "takes the place of √2. About one fold in twenty would be marked by "
    "chance."
)


def beside_paper(summary: Summary) -> pd.DataFrame | None:
    """Return a row for each fold, of the paper and of ours; None where they can't be compared."""
    families = published_families()
    found = [one for one in outcomes(summary) if one[0] in families]
    if not found or not has_published_grid(summary):
        return None
    names = dict.fromkeys(model for model, _, _ in found)
    spreads = ", ".join(
        f"{model_title(name, summary)} {spread_between_folds(families[name]):.1f}" for name in names
    )
    epochs = (
        ""
        if summary.preset == "paper"
        else f"Epochs are comparable with --preset paper alone; this is {summary.preset}. "
    )
    simulated = any(data.simulated for data in summary.data)
    return make_table(
        "Each fold beside the paper's",
        "Percent of test samples; the paper's to one decimal from the colours of its matrices, "
        "whose titles print them rounded. Best epoch: the one whose weights were kept. First "
        "epoch: accuracy in training (with dropout) and in validation; means over seeds. "
        f"{_RULE.format(spreads=spreads)} {epochs}"
        f"{_OTHER_LOG * ('sa-ste' in names)}{OTHER_RECORDINGS if simulated else SAME_GRID}",
        (
            "Model, protocol here", "Held out (mm/s)",
            "Accuracy: paper", "Accuracy: here", "Difference", "Larger than likely",
            "Best epoch: paper / here",
            "Epoch 1, training / validation: paper", "Epoch 1, training / validation: here",
        ),
        (
            (f"{model_title(model, summary)}, {protocol}", *row)
            for model, protocol, one in found
            for row in _fold_rows(families[model], one)
        ),
        n_headers=2,
    )  # fmt: skip


def has_published_grid(summary: Summary) -> bool:
    """Return whether folds learnt from the paper's textures at its speeds, on any recordings.

    A summary names the speeds held out, not those learnt from: of 13 textures more than
    13 x 9 recordings are all ten speeds, and some may be missing.
    """
    textures, speeds = published_textures(), published_speeds()
    nearly_all = len(textures) * (len(speeds) - 1)
    return (
        are_published(summary)
        and set(summary.speeds_mm_s) <= set(speeds)
        and all(data.n_recordings > nearly_all for data in summary.data)
        and OTHERS.isdisjoint(summary.options)
    )


def spread_between_folds(family: PublishedFamily) -> float:
    """Return the spread of one training of the paper's, percent points.

    Every fold but the first and last less the mean of its neighbours in speed; of equal and
    independent errors of standard deviation s this has s √1.5. What the trend with speed bends
    more than a line counts as spread, so s is rather too large.
    """
    accuracy = np.array([family.by_speed[speed] for speed in sorted(family.by_speed)])
    off = accuracy[1:-1] - (accuracy[:-2] + accuracy[2:]) / 2
    return float(np.sqrt((off**2).mean() / 1.5))


def likely(difference: float, spread: float, n_folds: int = 1, n_seeds: int = 1) -> bool:
    """Return whether the mean of so many folds may differ so by chance, percent points.

    Theirs are of one training each, ours the mean of `n_seeds`.
    """
    return abs(difference) <= 2 * spread * math.sqrt((1 + 1 / n_seeds) / n_folds)


def _fold_rows(family: PublishedFamily, found: Outcome) -> Iterator[tuple[str, ...]]:
    """Yield a row for each speed held out, and one of their mean."""
    spread = spread_between_folds(family)

    def compare(theirs: float, ours: float, n_folds: int) -> tuple[str, ...]:
        larger = "" if likely(ours - theirs, spread, n_folds, len(found.seeds)) else LARGER
        return f"{theirs:.1f}", f"{ours:.1f}", f"{ours - theirs:+.1f}", larger

    for key, share in found.by.items():
        fold = family.folds[float(key)]
        yield key, *compare(fold.percent, 100 * share, 1), *_course(fold, found, key)
    if len(found.by) > 1:
        theirs = float(np.mean([family.by_speed[float(key)] for key in found.by]))
        ours = 100 * float(np.mean(list(found.by.values())))
        yield "mean", *compare(theirs, ours, len(found.by)), "", "", ""


def _course(theirs: PublishedFold, found: Outcome, key: str) -> tuple[str, ...]:
    best, first = found.best_epoch.get(key), found.first_epoch.get(key)
    return (
        f"{theirs.best_epoch} / {', '.join(map(str, best)) if best else ABSENT}",
        f"{theirs.first_training_percent:.1f} / {theirs.first_validation_percent:.1f}",
        _means(first) if first else ABSENT,
    )


def _means(epochs: Sequence[FirstEpoch]) -> str:
    training, validation = np.mean([(one.training, one.validation) for one in epochs], axis=0)
    return f"{percent(training)} / {percent(validation)}"


# What differs by how much: models that differ in one thing, protocols, and whole runs.


def differences(summary: Summary) -> pd.DataFrame | None:
    """Return the table of paired differences; None where there is nothing to compare.

    First come those pairs of the paper's models that differ in one thing (afferent, encoding or
    stretching), then all pairs with other models; the summary holds every pair.
    """
    split = summary.split
    rows: list[tuple[Cell, ...]] = [
        (
            f"{model_title(one.model, summary)} over {model_title(one.than, summary)}",
            one.protocol,
            points(one),
        )
        for one in sorted(summary.comparisons, key=lambda c: not {c.model, c.than} <= set(TABLE1))
        if differ_in_one_thing(one.model, one.than)
    ]
    pairs = list(dict.fromkeys(row[0] for row in rows))
    rows.sort(key=lambda row: pairs.index(row[0]))
    rows += [
        (
            f"{model_title(model, summary)}: what the published protocol adds",
            "published over nested",
            points(found),
        )
        for model, found in summary.selection_effect.items()
    ]
    if not rows:
        return None
    return make_table(
        "Differences",
        f"Percentage points, mean over held-out {split.many}, with 95% interval in brackets: "
        f"drawn over {drawn_over(summary)}{and_seeds(summary)}, the same for both sides. An "
        "interval that holds 0 does not show a difference.",
        ("", "Protocol", "Difference"),
        rows,
        n_headers=2,
    )


def differ_in_one_thing(one: str, other: str) -> bool:
    """Return whether two of the paper's models differ in one thing alone; True of any others."""
    if not {one, other} <= set(TABLE1):
        return True
    a, b = TABLE1[one], TABLE1[other]
    different = (a.channel != b.channel, a.encoding != b.encoding, a.stretched != b.stretched)
    return sum(map(bool, different)) == 1


def points(found: Difference) -> str:
    """Return `+5.0 [-2.0, +12.3]`, percentage points."""
    low, high = (f"{100 * value:+.1f}" for value in found.ci95)
    return f"{100 * found.difference:+.1f} [{low}, {high}]"


def runs_side_by_side(runs: Mapping[str, Summary]) -> pd.DataFrame:
    """Return the means of several results folders, a column each.

    Parameters
    ----------
    runs
        Summaries by the name of their folder.
    """
    summaries = runs.values()
    many = " or ".join(dict.fromkeys(run.split.many for run in summaries))
    names = in_table_order([*dict.fromkeys(name for run in summaries for name in run.models)])
    return make_table(
        f"Accuracy at {many} held out of training, run by run",
        f"Percent of test samples, mean over held-out {many}, with 95% interval in brackets. "
        f"{'. '.join(f'{name}: {_what(run)}' for name, run in runs.items())}. "
        f"{across_modalities(names)}",
        ("Model", "Protocol", *runs),
        (
            (
                next(model_title(name, run) for run in summaries if name in run.models),
                protocol,
                *map(mean_and_interval, each),
            )
            for name in names
            for protocol in PROTOCOL_TITLES
            if any(each := [outcome(run, name, protocol) for run in summaries])
        ),
        n_headers=2,
    )


def _what(run: Summary) -> str:
    """Say in a few words what was evaluated."""
    options = f", {' '.join(shell_words(run.options))}" if run.options else ""
    return (
        f"{len(run.textures)} textures, {len(run.held_out)} {run.split.many}, preset {run.preset}"
        f"{options}, intervals over {drawn_over(run)}"
    )

"""Tables that compare: each fold with the paper's, models, protocols, and runs.

A fold is compared with the paper's only where textures and speeds are its own: a fold of other
speeds learnt from something else. A difference is marked where it is larger than the paper's own
spread between folds would make likely; the table states the rule.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from afferents.evaluation.options import shell_words
from afferents.evaluation.results import Difference, Outcome, Summary
from afferents.models.model import TABLE1
from afferents.reporting import labels, published, tables
from afferents.reporting.labels import ABSENT, PROTOCOL_TITLES, caption, model_title, percent

OTHERS = {
    "textures", "speeds", "train_speeds", "markers", "test_only", "without", "control", "disturb",
    "disturb_training",
}  # fmt: skip
"""Options with which folds learn from, or are tested on, something else than the paper's."""
LARGER = "yes"
"""What a difference that the spread does not make likely is marked with."""


def compare_folds(summary: Summary) -> pd.DataFrame | None:
    """Return a row for each fold, of the paper and of ours; None where they can't be compared."""
    families = published.published_families()
    found = [one for one in labels.outcomes(summary) if one[0] in families]
    if not found or not has_published_grid(summary):
        return None
    names = dict.fromkeys(model for model, _, _ in found)
    spreads = ", ".join(
        f"{model_title(name, summary)} {spread_between_folds(families[name]):.1f}" for name in names
    )
    simulated = any(data.simulated for data in summary.data)
    return tables.make_table(
        "Each fold next to the paper's",
        caption("folds", summary, spreads, "sa-ste" in names, simulated),
        (
            "Model, protocol here", "Held out (mm/s)",
            "Accuracy: paper", "Accuracy: here", "Difference", "Larger than likely",
            "Best epoch: paper / here",
            "Epoch 1, training / validation: paper", "Epoch 1, training / validation: here",
        ),
        (
            (f"{model_title(model, summary)}, {protocol}", *row)
            for model, protocol, one in found
            for row in _compare_family(families[model], one)
        ),
        n_headers=2,
    )  # fmt: skip


def has_published_grid(summary: Summary) -> bool:
    """Return whether folds learnt from the paper's textures at its speeds, on any recordings.

    A summary names the speeds held out, not those learnt from: of 13 textures more than
    13 x 9 recordings are all ten speeds, and some may be missing.
    """
    speeds = published.published_speeds()
    nearly_all = len(published.published_textures()) * (len(speeds) - 1)
    return (
        labels.are_published(summary)
        and set(summary.speeds_mm_s) <= set(speeds)
        and all(data.n_recordings > nearly_all for data in summary.data)
        and OTHERS.isdisjoint(summary.options)
    )


def spread_between_folds(family: published.PublishedFamily) -> float:
    """Return the spread of one training of the paper's, percent points.

    Every fold but the first and last less the mean of its neighbours in speed; of equal and
    independent errors of standard deviation s this has s √1.5. What the trend with speed bends
    more than a line counts as spread, so s is rather too large.
    """
    accuracy = np.array([family.by_speed[speed] for speed in sorted(family.by_speed)])
    off = accuracy[1:-1] - (accuracy[:-2] + accuracy[2:]) / 2
    return float(np.sqrt((off**2).mean() / 1.5))


def _compare_family(family: published.PublishedFamily, found: Outcome) -> Iterator[tuple[str, ...]]:
    """Yield a row for each speed held out, and one of their mean.

    The paper's folds are of one training each, ours the mean of a training for each seed.
    """
    spread, n_seeds = spread_between_folds(family), len(found.seeds)

    def compare(theirs: float, ours: float, n_folds: int) -> tuple[str, ...]:
        off = ours - theirs
        likely = abs(off) <= 2 * spread * math.sqrt((1 + 1 / n_seeds) / n_folds)
        return f"{theirs:.1f}", f"{ours:.1f}", f"{off:+.1f}", "" if likely else LARGER

    for key, share in found.by.items():
        fold, best, first = family.folds[float(key)], found.best_epoch.get(key), ABSENT
        if epochs := found.first_epoch.get(key):
            means = np.mean([(one.training, one.validation) for one in epochs], axis=0)
            first = " / ".join(map(percent, means))
        yield (
            key,
            *compare(fold.percent, 100 * share, 1),
            f"{fold.best_epoch} / {', '.join(map(str, best)) if best else ABSENT}",
            f"{fold.first_training_percent:.1f} / {fold.first_validation_percent:.1f}",
            first,
        )
    if len(found.by) > 1:
        theirs = float(np.mean([family.by_speed[float(key)] for key in found.by]))
        ours = 100 * float(np.mean(list(found.by.values())))
        yield "mean", *compare(theirs, ours, len(found.by)), "", "", ""


def differences(summary: Summary) -> pd.DataFrame | None:
    """Return the table of paired differences; None where there is nothing to compare.

    First come those pairs of the paper's models that differ in one thing (afferent, encoding or
    stretching), then all pairs with other models; the summary holds every pair.
    """
    rows: list[tuple[tables.Cell, ...]] = [
        (
            f"{model_title(one.model, summary)} over {model_title(one.than, summary)}",
            one.protocol,
            format_points(one),
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
            format_points(found),
        )
        for model, found in summary.selection_effect.items()
    ]
    if not rows:
        return None
    text = caption("differences", summary)
    return tables.make_table("Differences", text, ("", "Protocol", "Difference"), rows, n_headers=2)


def differ_in_one_thing(one: str, other: str) -> bool:
    """Return whether two of the paper's models differ in one thing alone; True of any others."""
    if not {one, other} <= set(TABLE1):
        return True
    a, b = TABLE1[one], TABLE1[other]
    different = (a.channel != b.channel, a.encoding != b.encoding, a.stretched != b.stretched)
    return sum(map(bool, different)) == 1


def format_points(found: Difference) -> str:
    """Return `+5.0 [-2.0, +12.3]`, percentage points."""
    low, high = (f"{100 * value:+.1f}" for value in found.ci95)
    return f"{100 * found.difference:+.1f} [{low}, {high}]"


def compare_summaries(runs: Mapping[str, Summary]) -> pd.DataFrame:
    """Return the means of several results folders, a column each.

    Parameters
    ----------
    runs
        Summaries by the name of their folder.
    """
    summaries, about = runs.values(), []
    for name, run in runs.items():
        options = f", {' '.join(shell_words(run.options))}" if run.options else ""
        about.append(
            f"{name}: {len(run.textures)} textures, {len(run.held_out)} {run.split.many}, preset "
            f"{run.preset}{options}, intervals over {labels.name_replicates(run)}"
        )
    many = " or ".join(dict.fromkeys(run.split.many for run in summaries))
    names = labels.order_models([*dict.fromkeys(name for run in summaries for name in run.models)])
    return tables.make_table(
        f"Accuracy at {many} held out of training, run by run",
        caption("compared", many, ". ".join(about), tables.spans_modalities(names)),
        ("Model", "Protocol", *runs),
        (
            (
                next(model_title(name, run) for run in summaries if name in run.models),
                protocol,
                *map(tables.mean_and_interval, each),
            )
            for name in names
            for protocol in PROTOCOL_TITLES
            if any(each := [labels.outcome(run, name, protocol) for run in summaries])
        ),
        n_headers=2,
    )

"""Tables that compare: with the paper, models, protocols, runs, and lengths of touch."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from afferents.folds.held_out import SPEED, key_of, split_of
from afferents.models.model import MODELS, TABLE1
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
    and_seeds,
    are_published,
    drawn_over,
    groups_in,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    preset_note,
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
    Table,
    mean_and_interval,
    worst_of,
)

# Each fold beside the paper's: accuracy, the epoch that was kept, and the first epoch.
#
# Only where textures and speeds are the paper's own: a fold of other speeds learnt from something
# else. A difference is marked where it is larger than the paper's own spread between folds would
# make likely; the rule is `spread_between_folds` and `likely`, and the table states it.

LARGER = "yes"
"""What stands beside a difference that the spread does not make likely."""
_OTHER_LOG = "The paper's accuracies of SA-STE are not of the trainings that its log tells of. "
_RULE = (
    "The rule: each of the paper's folds is compared with the mean of its two neighbours in speed, "
    "which takes the trend with speed away; the root mean square of that, divided by √1.5, is the "
    "spread s of one training (points: {spreads}). Two trainings then differ by a "
    "standard deviation of √2 s, and a difference beyond twice that (2.8 s) is marked; "
    "for the mean over n folds, beyond 2.8 s / √n. About one fold in twenty would be marked by "
    "chance."
)


def beside_paper(summary: Summary) -> Table | None:
    """Return a row for each fold, of the paper and of ours; None where they can't be compared."""
    found = [one for one in outcomes(summary) if one[0] in published_families()]
    if not found or not has_published_grid(summary):
        return None
    families = published_families()
    rows = [
        row
        for model, protocol, outcome in found
        for row in _rows(summary, families[model], model, protocol, outcome)
    ]
    names = dict.fromkeys(model for model, _, _ in found)
    spreads = ", ".join(
        f"{model_title(name, summary)} {spread_between_folds(families[name]):.1f}" for name in names
    )
    return Table(
        "Each fold beside the paper's",
        f"Percent of test samples; the paper's to one decimal from the colours of its matrices, "
        f"whose titles print them rounded. Best epoch: the one whose weights were kept. First "
        f"epoch: accuracy in training (with dropout) and in validation; means over seeds. "
        f"{_RULE.format(spreads=spreads)} {_recipe_note(summary)}"
        f"{_OTHER_LOG if 'sa-ste' in names else ''}{_recordings_note(summary)}",
        (
            "Model, protocol here", "Held out (mm/s)",
            "Accuracy: paper", "Accuracy: here", "Difference", "Larger than likely",
            "Best epoch: paper / here",
            "Epoch 1, training / validation: paper", "Epoch 1, training / validation: here",
        ),
        tuple(rows),
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
        split_of(summary) == SPEED
        and are_published(summary)
        and set(groups_in(summary)) <= set(speeds)
        and all(data["n_recordings"] > nearly_all for data in summary["data"])
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


def likely(difference: float, spread: float, n_folds: int = 1) -> bool:
    """Return whether the mean of so many folds may differ so by chance, percent points."""
    return abs(difference) <= 2 * math.sqrt(2) * spread / math.sqrt(n_folds)


def _rows(
    summary: Summary, family: PublishedFamily, model: str, protocol: str, found: dict[str, Any]
) -> Iterator[tuple[Cell, ...]]:
    spread = spread_between_folds(family)
    tested = {
        float(group): 100 * found["by_speed"][key_of(group)]
        for group in groups_in(summary)
        if found["by_speed"].get(key_of(group)) is not None
    }
    head = Cell(f"{model_title(model, summary)}, {protocol}")
    for speed, here in tested.items():
        yield (
            head,
            Cell(key_of(speed)),
            *_compared(family.folds[speed].percent, here, spread, 1),
            *_course(family.folds[speed], found, key_of(speed)),
        )
    if len(tested) > 1:
        theirs = float(np.mean([family.by_speed[speed] for speed in tested]))
        ours = float(np.mean(list(tested.values())))
        cells = _compared(theirs, ours, spread, len(tested))
        yield head, Cell("mean"), *cells, *[Cell("")] * 3


def _compared(theirs: float, ours: float, spread: float, n_folds: int) -> tuple[Cell, ...]:
    difference = ours - theirs
    return (
        Cell(f"{theirs:.1f}"),
        Cell(f"{ours:.1f}"),
        Cell(f"{difference:+.1f}"),
        Cell("" if likely(difference, spread, n_folds) else LARGER),
    )


def _course(theirs: PublishedFold, found: dict[str, Any], key: str) -> tuple[Cell, ...]:
    best, first = found.get("best_epoch", {}).get(key), found.get("first_epoch", {}).get(key)
    return (
        Cell(f"{theirs.best_epoch} / {', '.join(map(str, best)) if best else ABSENT}"),
        Cell(f"{theirs.first_training_percent:.1f} / {theirs.first_validation_percent:.1f}"),
        Cell(f"{_mean(first, 'training')} / {_mean(first, 'validation')}" if first else ABSENT),
    )


def _mean(epochs: Sequence[dict[str, float]], name: str) -> str:
    return percent(float(np.mean([epoch[name] for epoch in epochs])))


def _recordings_note(summary: Summary) -> str:
    """Return how far recordings may be the paper's; they may hold out a few of its speeds only."""
    simulated = any(data["simulated"] for data in summary["data"])
    return OTHER_RECORDINGS if simulated else SAME_GRID


def _recipe_note(summary: Summary) -> str:
    if summary["preset"] == "paper":
        return ""
    return f"Epochs are comparable with --preset paper alone; this is {summary['preset']}. "


# What differs by how much: models that differ in one thing, protocols, and whole runs.


def differences(summary: Summary) -> Table | None:
    """Return the table of paired differences; None where there is nothing to compare.

    Of the paper's families those pairs that differ in one thing (afferent, encoding or
    stretching) are shown, of other models all; the summary holds every pair.
    """
    split = split_of(summary)
    rows = [
        (
            Cell(" over ".join(model_title(found[one], summary) for one in ("model", "than"))),
            Cell(PROTOCOL_TITLES[found["protocol"]]),
            Cell(_points(found)),
        )
        for found in summary.get("comparisons", [])
        if _differ_in_one_thing(found["model"], found["than"])
    ]
    pairs = list(dict.fromkeys(row[0].text for row in rows))
    rows.sort(key=lambda row: pairs.index(row[0].text))
    rows += [
        (
            Cell(
                f"{model_title(model, summary)}: what selection on the held-out {split.name} adds"
            ),
            Cell("published over nested"),
            Cell(_points(found)),
        )
        for model, found in summary.get("selection_effect", {}).items()
    ]
    if not rows:
        return None
    return Table(
        "Differences",
        f"Percentage points, mean over held-out {split.many}, with 95% interval in brackets: "
        f"drawn over {drawn_over(summary)}{and_seeds(summary)}, the same for both sides. An "
        "interval that holds 0 does not show a difference.",
        ("", "Protocol", "Difference"),
        tuple(rows),
        n_headers=2,
    )


def runs_side_by_side(runs: Mapping[str, Summary]) -> Table:
    """Return the means of several results folders, a column each.

    Parameters
    ----------
    runs
        Summaries by the name of their folder.
    """
    models = list(dict.fromkeys(name for run in runs.values() for name in model_order(run)))
    ordered = [*(name for name in MODELS if name in models)]
    ordered += [name for name in models if name not in MODELS]
    own = {"titles": {k: v for run in runs.values() for k, v in run.get("titles", {}).items()}}
    rows = [
        (
            Cell(model_title(name, own)),
            Cell(title),
            *(Cell(mean_and_interval(found)) for found in each),
        )
        for name in ordered
        for protocol, title in PROTOCOL_TITLES.items()
        if any(each := [outcome(run, name, protocol) for run in runs.values()])
    ]
    many = " or ".join(dict.fromkeys(split_of(run).many for run in runs.values()))
    return Table(
        f"Accuracy at {many} held out of training, run by run",
        f"Percent of test samples, mean over held-out {many}, with 95% interval in brackets. "
        f"{'. '.join(f'{name}: {_what(run)}' for name, run in runs.items())}.",
        ("Model", "Protocol", *runs),
        tuple(rows),
        n_headers=2,
    )


def _differ_in_one_thing(one: str, other: str) -> bool:
    if not {one, other} <= set(TABLE1):
        return True
    a, b = TABLE1[one], TABLE1[other]
    different = (a.channel != b.channel, a.encoding != b.encoding, a.stretched != b.stretched)
    return sum(map(bool, different)) == 1


def _points(found: Mapping[str, Any]) -> str:
    low, high = (f"{100 * value:+.1f}" for value in found["ci95"])
    return f"{100 * found['difference']:+.1f} [{low}, {high}]"


def _what(run: Summary) -> str:
    """Say in a few words what was evaluated."""
    n = len(run["textures"])
    options = f", {' '.join(run['options'])}" if run.get("options") else ""
    split = split_of(run)
    return (
        f"{n} textures, {len(groups_in(run))} {split.many}, preset {run['preset']}{options}, "
        f"intervals over {drawn_over(run)}"
    )


# Accuracy by length of touch: all models on the same footing.


def by_touch_table(summary: Summary) -> Table | None:
    """Return how well touches of equal length are named by all models; None of earlier results."""
    found = [
        (*who, result["by_touch"]) for *who, result in outcomes(summary) if "by_touch" in result
    ]
    if not found:
        return None
    split, lengths = split_of(summary), list(found[0][-1])
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(protocol),
            *(
                cell
                for length in lengths
                for cell in _cells(of_length.get(length), split.by, split.worst)
            ),
        )
        for model, protocol, of_length in found
    ]
    return Table(
        "Accuracy by length of touch",
        "Percent of touches named rightly, each by the mean log-probability of the samples that it "
        f"is made of: mean over held-out {split.many}, with 95% interval in brackets "
        f"(over {drawn_over(summary)}), and in the worst of them. "
        "Whole samples stand for a length that they come within a quarter of. "
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", *(h for n in lengths for h in (f"{n} s", f"worst, {n} s"))),
        tuple(rows),
        n_headers=2,
    )


def _cells(found: dict[str, Any] | None, by: str, worst: str) -> tuple[Cell, Cell]:
    if found is None:
        return Cell(ABSENT), Cell(ABSENT)
    lowest = found[by][found[worst]]
    return Cell(mean_and_interval(found)), Cell(percent(lowest), 100 * lowest)


# How well samples and whole recordings are named: overall, between speeds, and at the ends.


def touches_table(summary: Summary) -> Table:
    """Return how well samples and whole recordings are named, between the speeds and beyond.

    Of groups that lie on no scale: over all of them, and in the worst.
    """
    split = split_of(summary)
    if not split.ordered:
        return _touches_of_groups(summary)
    speeds = [key_of(speed) for speed in groups_in(summary)]
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(protocol),
            Cell(unit),
            Cell(mean_and_interval(found)),
            Cell(mean_and_interval(found.get("inside"))),
            *(Cell(_at(summary, found, end)) for end in (speeds[0], speeds[-1])),
        )
        for model, protocol, result in outcomes(summary)
        for unit, found in (("a sample", result), ("a recording", result.get("recordings")))
        if found is not None
    ]
    return Table(
        "Samples and whole recordings, speeds between others and at the ends",
        "Percent named rightly. A recording is named by the sum of its samples' log-probabilities. "
        "Between: held-out speeds that lie between speeds trained on; to hold out the slowest or "
        f"the fastest is to extrapolate. In brackets: 95% interval (over {drawn_over(summary)}). "
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", "Of", "All speeds", "Between", *(
            f"{end} mm/s" for end in (speeds[0], speeds[-1])
        )),
        tuple(rows),
        n_headers=3,
    )  # fmt: skip


def _touches_of_groups(summary: Summary) -> Table:
    split = split_of(summary)
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(protocol),
            Cell(unit),
            Cell(mean_and_interval(found)),
            Cell(worst_of(summary, found)),
        )
        for model, protocol, result in outcomes(summary)
        for unit, found in (("a sample", result), ("a recording", result.get("recordings")))
        if found is not None
    ]
    return Table(
        "Samples and whole recordings",
        "Percent named rightly. A recording is named by the sum of its samples' log-probabilities; "
        f"95% interval in brackets (over {drawn_over(summary)}). {preset_note(summary)}".rstrip(),
        ("Model", "Protocol", "Of", f"Over all {split.many}", "Worst"),
        tuple(rows),
        n_headers=3,
    )


def _at(summary: Summary, found: dict[str, Any], group: str) -> str:
    """Return the accuracy in one group held out, with its interval where there is one."""
    split = split_of(summary)
    accuracy = found[split.by].get(group)
    if accuracy is None:
        return ABSENT
    interval = found.get(split.ci95_by, {}).get(group)
    if interval is None:
        return percent(accuracy)
    low, high = (percent(end, 0) for end in interval)
    return f"{percent(accuracy)} [{low}, {high}]"

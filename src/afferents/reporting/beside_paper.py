"""Each fold beside the paper's: accuracy, the epoch that was kept, and the first epoch.

Only where textures and speeds are the paper's own: a fold of other speeds learnt from something
else. A difference is marked where it is larger than the paper's own spread between folds would
make likely; the rule is `spread_between_folds` and `likely`, and the table states it.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from afferents.core.split import SPEED, key_of, split_of
from afferents.reporting.labels import (
    ABSENT,
    Summary,
    groups_in,
    model_title,
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
from afferents.reporting.table import OTHER_RECORDINGS, SAME_GRID, Cell, Table
from afferents.reporting.texture_names import are_published

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

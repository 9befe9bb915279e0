"""What differs by how much: models that differ in one thing, protocols, and whole runs."""

from collections.abc import Mapping
from typing import Any

from afferents.core.model import MODELS, TABLE1
from afferents.core.split import split_of
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    groups_in,
    model_order,
    model_title,
    outcome,
)
from afferents.reporting.replicates import drawn_over
from afferents.reporting.table import Cell, Table, mean_and_interval


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
        f"drawn over {drawn_over(summary)}, and over training seeds, the same for both sides. An "
        "interval that holds 0 shows no difference.",
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

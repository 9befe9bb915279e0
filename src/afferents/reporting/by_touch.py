"""Accuracy by length of touch: all models on the same footing."""

from typing import Any

from afferents.core.split import split_of
from afferents.reporting.labels import (
    ABSENT,
    Summary,
    model_title,
    outcomes,
    percent,
    preset_note,
)
from afferents.reporting.replicates import drawn_over
from afferents.reporting.table import Cell, Table, mean_and_interval


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

"""What the columns of a table do: those that count, label or hold texts are no signals."""

from collections.abc import Mapping, Sequence

import numpy as np

from afferents.recordings.tables import Table

RISES, TEXTS = "it rises or falls from row to row, as counters and clocks do", "it holds no numbers"
LABELS, DEAD = "it has one value in each file, as labels do", "it never changes, in any file"
_BACK, _ON = 0.01, 0.2
"""A counter or clock, which may begin again, goes back in no more than the first share of its
steps, and on in the second at least."""
Courses = Mapping[str, str | float | None]
"""Of each column by name: `RISES`, `TEXTS`, its value if it has one only, else None."""


def describe_columns(table: Table) -> Courses:
    """Return what each column of a table does, by name."""
    found: dict[str, str | float | None] = {}
    for name, column in zip(table.columns, table.values.T, strict=True):
        values = column[np.isfinite(column)]
        step = np.diff(values)
        if not len(values):
            found[name] = TEXTS
        elif not step.any():
            found[name] = float(values[0])
        else:
            back, on = sorted([(step > 0).mean(), (step < 0).mean()])
            found[name] = RISES if back <= _BACK and on >= _ON else None
    return found


def find_non_signals(files: Sequence[Courses]) -> dict[str, str]:
    """Return why columns are no signals, by name, from what they do in all files.

    Those that are `DEAD` may be sensors that failed.
    """
    why = {}
    for name in files[0]:
        its = {one.get(name) for one in files}
        if all(isinstance(value, float) for value in its):
            why[name] = LABELS if len(its) > 1 else DEAD
        elif len(its) == 1 and isinstance(reason := its.pop(), str):
            why[name] = reason
    return why

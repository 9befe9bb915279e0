"""The table of an evaluation that asks for spacings in mm."""

from typing import Any

from afferents.reporting.labels import ABSENT, model_title, percent
from afferents.reporting.table import Cell, Table

KINDS = {"seen": "felt at other speeds", "unseen": "never felt"}


def roughness_table(summary: dict[str, Any]) -> Table:
    """Return the errors in mm of every model, for textures felt before and never felt."""
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(KINDS[kind]),
            *(Cell(_mm(found[key])) for key in ("mae_mm", "mae_mm_inside", "mae_mm_recordings")),
            Cell(_worst(found["by_speed"], "mm/s")),
            Cell(_worst(found["by_spacing"], "mm")),
            Cell(f"+-{_mm(found['half_interval_mm'])}: {percent(found['covered'])} %"),
        )
        for model, kinds in summary["models"].items()
        for kind, found in kinds.items()
    ]
    return Table(
        "Bump spacing as a number, at speeds held out of training",
        "Mean absolute error in mm, mean over held-out speeds; between: of those that lie between "
        "others; recordings: of the mean over a recording. Intervals are as wide as "
        f"{percent(summary['coverage_asked'], 0)} % of the errors inside the training data; "
        "beside them stands the share of the held-out samples that they held, which nothing "
        "promises.",
        ("Model", "Textures", "Samples", "Between", "Recordings", "Worst speed", "Worst spacing",
         "Interval by inner errors, and share that it held"),
        tuple(rows),
        n_headers=2,
    )  # fmt: skip


def _mm(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.2f}"


def _worst(errors: dict[str, float], unit: str) -> str:
    worst = max(errors, key=lambda key: errors[key])
    return f"{worst} {unit}: {errors[worst]:.2f}"

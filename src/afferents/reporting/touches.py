"""How well samples and whole recordings are named: overall, between speeds, and at the ends."""

from typing import Any

from afferents.core.split import key_of, split_of
from afferents.reporting.labels import (
    ABSENT,
    Summary,
    groups_in,
    model_title,
    outcomes,
    percent,
    preset_note,
)
from afferents.reporting.replicates import drawn_over
from afferents.reporting.table import Cell, Table, mean_and_interval, worst_of


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

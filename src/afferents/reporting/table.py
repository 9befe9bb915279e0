"""The tables of the report: Table 1, accuracy by held-out speed, leaks, and how models ran."""

from dataclasses import dataclass
from typing import Any

from afferents.core.model import MODELS, TABLE1
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    preset_note,
    speed_key,
)
from afferents.reporting.published import published_families, published_speeds, published_textures

TABLE1_COLUMNS = (
    "Model",
    "Paper, its own recordings",
    "Here, nested protocol",
    "Here, published protocol",
    "Worst speed here",
)
OTHER_RECORDINGS = (
    "The paper's column was measured on other recordings (Pestell & Lepora 2022, published "
    "protocol): this is no reproduction of it, and a difference is no failure to reproduce."
)
SAME_GRID = (
    "The textures and speeds are those of the paper. The paper's column is comparable only if "
    "these are the published recordings themselves, which the results cannot tell."
)


@dataclass(frozen=True)
class Cell:
    """A cell: its text, and its accuracy in percent where shading by it helps to read."""

    text: str
    percent: float | None = None

    @property
    def absent(self) -> bool:
        """Whether there is nothing to show."""
        return self.text == ABSENT


@dataclass(frozen=True)
class Table:
    """A table to print: the first `n_headers` cells of every row say what the row is."""

    title: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    n_headers: int = 1


def table1(summary: Summary) -> Table:
    """Return Table 1: the paper's mean beside ours under either protocol, in percent.

    All six families have a row, also where nothing was evaluated; other models follow.
    """
    others = [name for name in model_order(summary) if name not in TABLE1]
    return Table(
        "Table 1. Accuracy at speeds held out of training",
        f"Percent of test samples, mean over held-out speeds, with 95% interval in brackets. "
        f"Chance: {percent(summary['chance'])}. {comparison_note(summary)} "
        f"{preset_note(summary)}".rstrip(),
        TABLE1_COLUMNS,
        tuple(_table1_row(summary, name) for name in (*TABLE1, *others)),
    )


def accuracy_by_speed(summary: Summary) -> Table:
    """Return the accuracy of every model at every held-out speed, the paper's beneath ours."""
    speeds = summary["speeds_mm_s"]
    rows = [
        row
        for name in model_order(summary)
        for row in (*_own_speed_rows(summary, name), *_paper_speed_row(speeds, name))
    ]
    return Table(
        "Accuracy by held-out speed (mm/s)",
        "Percent of test samples; columns are held-out speeds in mm/s. The paper's figures stand "
        "where it has the same speed; they "
        "were measured on its own recordings, under the published protocol. "
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", *map(speed_key, speeds)),
        tuple(rows),
        n_headers=2,
    )


def touches_table(summary: Summary) -> Table:
    """Return how well samples and whole recordings are named, between the speeds and beyond."""
    speeds = [speed_key(speed) for speed in summary["speeds_mm_s"]]
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            Cell(unit),
            Cell(mean_and_interval(found.get("inside"))),
            Cell(_worst_of(found.get("inside"))),
            *(_accuracy_cell(found["by_speed"].get(end)) for end in (speeds[0], speeds[-1])),
        )
        for model, protocol, result in outcomes(summary)
        for unit, found in (("a sample", result), ("a recording", result.get("recordings")))
        if found is not None
    ]
    return Table(
        "Samples and whole recordings, speeds between others and at the ends",
        "Percent named rightly. A recording is named by the sum of its samples' log-probabilities. "
        "Between: held-out speeds that lie between speeds trained on, with 95% interval in "
        "brackets; to hold out the slowest or the fastest is to extrapolate. "
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", "Of", "Between", "Worst between", *(
            f"{end} mm/s" for end in (speeds[0], speeds[-1])
        )),
        tuple(rows),
        n_headers=3,
    )  # fmt: skip


def leak_table(summary: Summary) -> Table:
    """Return what each model saw of the held-out speed before its final test, as counted."""
    rows = tuple(
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            Cell(f"{found['n_test']:,}"),
            *(_leak_cell(found["leaks"].get(name)) for name in LEAKS),
        )
        for model, protocol, found in outcomes(summary)
    )
    return Table(
        "What was seen of the held-out speed before the final test",
        "Counted over all held-out speeds and seeds.",
        ("Model", "Protocol", "Test samples", *LEAKS.values()),
        rows,
        n_headers=2,
    )


LEAKS = {
    "test_samples_of_a_speed_seen_in_training": "… of a speed trained on",
    "test_samples_of_a_speed_seen_in_validation": "… of a speed that picked the model",
    "test_samples_overlapping_validation": "… overlapping validation in time",
    "test_samples_overlapping_training": "… overlapping training in time",
    "scale_saw_held_out_speed": "Scale saw the held-out speed",
}
"""Leaks as `summary.json` names them, and the heads of their columns."""


def leak_sentences(summary: Summary) -> list[str]:
    """Return one sentence a protocol that names its leaks, or says that there are none."""
    sentences = []
    for protocol in PROTOCOL_TITLES:
        found = [result for _, name, result in outcomes(summary) if name == protocol]
        if found:
            sentences.append(f"{PROTOCOL_TITLES[protocol].capitalize()}: {_leak_sentence(found)}")
    return sentences


def run_table(summary: Summary) -> Table:
    """Return how each model was run: seeds, epochs, time, macro-F1 and what validated it."""
    rows = tuple(
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            Cell(f"{found['macro_f1']:.3f}"),
            Cell(", ".join(map(str, found["seeds"]))),
            Cell(_epochs(found)),
            Cell(_validation(found)),
            Cell(f"{found['seconds']:,.0f}"),
        )
        for model, protocol, found in outcomes(summary)
    )
    return Table(
        "How the models were trained",
        "Speeds are in mm/s: held out → validated by.",
        ("Model", "Protocol", "Macro-F1", "Seeds", "Epochs", "Validation speed", "Time (s)"),
        rows,
        n_headers=2,
    )


def comparison_note(summary: Summary) -> str:
    """Return the sentence that says how far the paper's column may be compared with ours."""
    same_grid = tuple(summary["textures"]) == published_textures() and tuple(
        summary["speeds_mm_s"]
    ) == tuple(published_speeds())
    simulated = any(data["simulated"] for data in summary["data"])
    return SAME_GRID if same_grid and not simulated else OTHER_RECORDINGS


def mean_and_interval(found: dict[str, Any] | None) -> str:
    """Return `50.1 [40.2, 60.3]` in percent; the interval is left out where there is none."""
    if found is None:
        return ABSENT
    mean, interval = percent(found["mean_accuracy"]), found.get("ci95")
    return f"{mean} [{percent(interval[0])}, {percent(interval[1])}]" if interval else mean


def _table1_row(summary: Summary, name: str) -> tuple[Cell, ...]:
    paper = published_families().get(name)
    return (
        Cell(model_title(name, summary)),
        Cell(str(paper.mean_percent)) if paper else Cell(ABSENT),
        *(Cell(mean_and_interval(outcome(summary, name, key))) for key in PROTOCOL_TITLES),
        Cell(_worst_speed(summary, name)),
    )


def _worst_speed(summary: Summary, name: str) -> str:
    """Return the worst held-out speed under the strictest protocol that was run."""
    for protocol in PROTOCOL_TITLES:
        found = outcome(summary, name, protocol)
        if found is not None:
            worst = found["worst_speed"]
            return f"{worst} mm/s: {percent(found['by_speed'][worst])}"
    return ABSENT


def _worst_of(found: dict[str, Any] | None) -> str:
    if found is None:
        return ABSENT
    worst = found["worst_speed"]
    return f"{worst} mm/s: {percent(found['by_speed'][worst])}"


def _own_speed_rows(summary: Summary, name: str) -> list[tuple[Cell, ...]]:
    keys = [speed_key(speed) for speed in summary["speeds_mm_s"]]
    found = [(title, outcome(summary, name, key)) for key, title in PROTOCOL_TITLES.items()]
    return [
        (
            Cell(model_title(name, summary)),
            Cell(title),
            *(_accuracy_cell(result["by_speed"].get(key)) for key in keys),
        )
        for title, result in found
        if result is not None
    ]


def _paper_speed_row(speeds: list[float], name: str) -> list[tuple[Cell, ...]]:
    paper = published_families().get(name)
    if paper is None or not set(speeds) & set(paper.by_speed):
        return []
    values = (paper.by_speed.get(speed) for speed in speeds)
    cells = (Cell(ABSENT) if value is None else Cell(f"{value:.1f}", value) for value in values)
    return [(Cell(MODELS[name].title), Cell("paper"), *cells)]


def _accuracy_cell(fraction: float | None) -> Cell:
    return Cell(ABSENT) if fraction is None else Cell(percent(fraction), 100 * fraction)


def _leak_cell(value: bool | int | None) -> Cell:
    if value is None:
        return Cell("not counted")
    return Cell(("yes" if value else "no") if isinstance(value, bool) else f"{value:,}")


def _leak_sentence(found: list[dict[str, Any]]) -> str:
    counts = [sum(result["leaks"].get(name) or 0 for result in found) for name in LEAKS]
    trained, of_speed, validation, training, scale = counts
    if not any(counts):
        return "nothing of a held-out speed was seen before its one final test."
    scaled = "; scaling constants had seen the held-out speed" if scale else ""
    return (
        f"{of_speed:,} of {sum(result['n_test'] for result in found):,} test samples are of a "
        f"speed that picked the model and {trained:,} of one trained on; {validation:,} overlap "
        f"validation samples in time and "
        f"{training:,} overlap training samples{scaled}. Its accuracy is not that of an unseen "
        f"speed."
    )


def _epochs(found: dict[str, Any]) -> str:
    epochs = [count for counts in found["epochs"].values() for count in counts]
    if not epochs:
        return ABSENT
    low, high = min(epochs), max(epochs)
    return f"{low}" if low == high else f"{low} to {high}"


def _validation(found: dict[str, Any]) -> str:
    speeds = found["validation_speeds"]
    if all(float(held_out) == float(speed) for held_out, speed in speeds.items()):
        return "the held-out speed itself"
    return ", ".join(f"{held_out} → {speed:g}" for held_out, speed in speeds.items())

"""The tables of the report: Table 1, accuracy by held-out speed, leaks, and how models ran."""

from dataclasses import dataclass
from typing import Any

from afferents.folds.held_out import SPEED, key_of, split_of
from afferents.models.model import MODELS, TABLE1
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    Summary,
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
from afferents.reporting.published import published_families, published_speeds

PAPER_ROW = "paper"
PAPER_COLUMN = "Paper, its own recordings"
OTHER_RECORDINGS = (
    "The paper's column was measured on other recordings (Pestell & Lepora 2022, published "
    "protocol): this is no reproduction of it, and a difference is no failure to reproduce."
)
SAME_GRID = (
    "The textures and speeds are those of the paper. The paper's column is comparable only if "
    "these are the published recordings themselves, which the results cannot tell."
)
_NAMED = 5
"""So many missing recordings are named below the table; the page names all."""


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
    split = split_of(summary)
    paper = (PAPER_COLUMN,) if split == SPEED else ()
    here = (f"Here, {title}" for title in PROTOCOL_TITLES.values())
    return Table(
        f"Table 1. Accuracy at {split.many} held out of training",
        f"Percent of test samples, mean over held-out {split.many}, with 95% interval in brackets "
        f"(over {drawn_over(summary)}). Chance: {percent(summary['chance'])}. "
        f"{missing_note(summary)}{comparison_note(summary)} {preset_note(summary)}".rstrip(),
        ("Model", *paper, *here, f"Worst {split.name} here"),
        tuple(_table1_row(summary, name) for name in (*TABLE1, *others)),
    )


def missing_note(summary: Summary) -> str:
    """Say how many recordings the numbers are without, and which; empty where none is missing."""
    missing = [entry["recording"] for entry in summary["skipped"]]
    if not missing:
        return ""
    named = ", ".join(missing[:_NAMED]) + (" and others" if len(missing) > _NAMED else "")
    are = "recording is" if len(missing) == 1 else "recordings are"
    return f"{len(missing)} {are} missing: {named}. "


def accuracy_by_speed(summary: Summary) -> Table:
    """Return the accuracy of every model by group held out.

    The paper's stand beneath ours where the textures are its own and what is held out are speeds.
    """
    groups, split = groups_in(summary), split_of(summary)
    rows = [
        row
        for name in model_order(summary)
        for row in (*_own_rows(summary, name), *_paper_speed_row(summary, name))
    ]
    of_paper = (
        "The paper's figures stand where it has the same speed; they were measured on its own "
        "recordings, under the published protocol. "
        if any(row[1].text == PAPER_ROW for row in rows)
        else ""
    )
    columns = "held-out speeds in mm/s" if split == SPEED else f"held-out {split.many}"
    return Table(
        f"Accuracy by held-out {split.axis}",
        f"Percent of test samples; columns are {columns}. {of_paper}"
        f"{preset_note(summary)}".rstrip(),
        ("Model", "Protocol", *map(key_of, groups)),
        tuple(rows),
        n_headers=2,
    )


def leak_table(summary: Summary) -> Table:
    """Return what each model saw of the group held out before its final test, as counted."""
    split, heads = split_of(summary), leaks_of(summary)
    rows = tuple(
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            Cell(f"{found['n_test']:,}"),
            *(_leak_cell(found["leaks"].get(name)) for name in heads),
        )
        for model, protocol, found in outcomes(summary)
    )
    return Table(
        f"What was seen of the held-out {split.name} before the final test",
        f"Counted over all held-out {split.many} and seeds.",
        ("Model", "Protocol", "Test samples", *heads.values()),
        rows,
        n_headers=2,
    )


def leaks_of(summary: Summary) -> dict[str, str]:
    """Return leaks as the summary names them, and the heads of their columns."""
    split = split_of(summary)
    return {
        f"test_samples_of_a_{split.leaks}_seen_in_training": f"… of {split.one} trained on",
        f"test_samples_of_a_{split.leaks}_seen_in_validation": (
            f"… of {split.one} that picked the model"
        ),
        "test_samples_overlapping_validation": "… overlapping validation in time",
        "test_samples_overlapping_training": "… overlapping training in time",
        f"scale_saw_held_out_{split.leaks}": f"Scale saw the held-out {split.name}",
    }


def leak_sentences(summary: Summary) -> list[str]:
    """Return one sentence a protocol that names its leaks, or says that there are none."""
    sentences = []
    for protocol in PROTOCOL_TITLES:
        found = [result for _, name, result in outcomes(summary) if name == protocol]
        if found:
            sentences.append(
                f"{PROTOCOL_TITLES[protocol].capitalize()}: {_leak_sentence(summary, found)}"
            )
    return sentences


def run_table(summary: Summary) -> Table:
    """Return how each model was run: seeds, epochs, time, macro-F1 and what validated it."""
    split = split_of(summary)
    of_groups = "Speeds are in mm/s" if split == SPEED else split.many.capitalize()
    rows = tuple(
        (
            Cell(model_title(model, summary)),
            Cell(PROTOCOL_TITLES[protocol]),
            Cell(f"{found['macro_f1']:.3f}"),
            Cell(", ".join(map(str, found["seeds"]))),
            Cell(_epochs(found)),
            Cell(_validation(summary, found)),
            Cell(f"{found['seconds']:,.0f}"),
        )
        for model, protocol, found in outcomes(summary)
    )
    return Table(
        "How the models were trained",
        f"{of_groups}: held out → validated by.",
        (
            "Model",
            "Protocol",
            "Macro-F1",
            "Seeds",
            "Epochs",
            f"Validation {split.name}",
            "Time (s)",
        ),
        rows,
        n_headers=2,
    )


def comparison_note(summary: Summary) -> str:
    """Return the sentence that says how far the paper's column may be compared with ours."""
    split = split_of(summary)
    if split != SPEED:
        return f"The paper holds out speeds: its figures are not comparable with {split.many}."
    same_speeds = tuple(groups_in(summary)) == tuple(published_speeds())
    same_grid = are_published(summary) and same_speeds
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
    of_paper = Cell(str(paper.mean_percent)) if paper else Cell(ABSENT)
    return (
        Cell(model_title(name, summary)),
        *([of_paper] if split_of(summary) == SPEED else []),
        *(Cell(mean_and_interval(outcome(summary, name, key))) for key in PROTOCOL_TITLES),
        Cell(_worst(summary, name)),
    )


def _worst(summary: Summary, name: str) -> str:
    """Return the worst group held out, under the strictest protocol that was run."""
    for protocol in PROTOCOL_TITLES:
        found = outcome(summary, name, protocol)
        if found is not None:
            return worst_of(summary, found)
    return ABSENT


def worst_of(summary: Summary, found: dict[str, Any] | None) -> str:
    """Return `10 mm/s: 25.0`: the group where accuracy is lowest."""
    if found is None:
        return ABSENT
    split = split_of(summary)
    worst = found[split.worst]
    return f"{split.printed(worst)}: {percent(found[split.by][worst])}"


def _own_rows(summary: Summary, name: str) -> list[tuple[Cell, ...]]:
    keys, by = [key_of(group) for group in groups_in(summary)], split_of(summary).by
    found = [(title, outcome(summary, name, key)) for key, title in PROTOCOL_TITLES.items()]
    return [
        (
            Cell(model_title(name, summary)),
            Cell(title),
            *(_accuracy_cell(result[by].get(key)) for key in keys),
        )
        for title, result in found
        if result is not None
    ]


def _paper_speed_row(summary: Summary, name: str) -> list[tuple[Cell, ...]]:
    paper, groups = published_families().get(name), groups_in(summary)
    if paper is None or split_of(summary) != SPEED or not are_published(summary):
        return []
    if not set(groups) & set(paper.by_speed):
        return []
    values = (paper.by_speed.get(float(group)) for group in groups)
    cells = (Cell(ABSENT) if value is None else Cell(f"{value:.1f}", value) for value in values)
    return [(Cell(MODELS[name].title), Cell(PAPER_ROW), *cells)]


def _accuracy_cell(fraction: float | None) -> Cell:
    return Cell(ABSENT) if fraction is None else Cell(percent(fraction), 100 * fraction)


def _leak_cell(value: bool | int | None) -> Cell:
    if value is None:
        return Cell("not counted")
    return Cell(("yes" if value else "no") if isinstance(value, bool) else f"{value:,}")


def _leak_sentence(summary: Summary, found: list[dict[str, Any]]) -> str:
    name = split_of(summary).name
    counts = [sum(one["leaks"].get(leak) or 0 for one in found) for leak in leaks_of(summary)]
    trained, of_group, validation, training, scale = counts
    if not any(counts):
        return f"nothing of a held-out {name} was seen before its one final test."
    scaled = f"; scaling constants had seen the held-out {name}" if scale else ""
    return (
        f"{of_group:,} of {sum(result['n_test'] for result in found):,} test samples are of "
        f"{split_of(summary).one} that picked the model and {trained:,} of one trained on; "
        f"{validation:,} overlap validation samples in time and "
        f"{training:,} overlap training samples{scaled}. Its accuracy is not that of an unseen "
        f"{name}."
    )


def _epochs(found: dict[str, Any]) -> str:
    epochs = [count for counts in found["epochs"].values() for count in counts]
    if not epochs:
        return ABSENT
    low, high = min(epochs), max(epochs)
    return f"{low}" if low == high else f"{low} to {high}"


def _validation(summary: Summary, found: dict[str, Any]) -> str:
    split = split_of(summary)
    groups = {held_out: key_of(group) for held_out, group in found[split.validations].items()}
    if all(held_out == group for held_out, group in groups.items()):
        return f"the held-out {split.name} itself"
    return ", ".join(f"{held_out} → {group}" for held_out, group in groups.items())


# A `Table` as markdown; the page has its own template, the command line its own layout.


def to_markdown(table: Table) -> str:
    """Return the table as a markdown heading, pipe table and caption."""
    marks = ["---"] * table.n_headers + ["---:"] * (len(table.columns) - table.n_headers)
    lines = [list(table.columns), marks, *([cell.text for cell in row] for row in table.rows)]
    body = "\n".join(f"| {' | '.join(_escape(text) for text in line)} |" for line in lines)
    return f"### {table.title}\n\n{body}\n\n{table.caption}\n"


def _escape(text: str) -> str:
    return text.replace("|", r"\|")

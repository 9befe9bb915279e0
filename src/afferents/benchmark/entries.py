"""What came out for a model on a task: one line of JSON, and tables of many."""

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pandas as pd
from pydantic import BaseModel, ConfigDict, Field

from afferents.documents import as_form, parse_json
from afferents.errors import InputError
from afferents.files import holds_only, require_free, write_text
from afferents.folds.controls import CONTROLS
from afferents.forms import Amount, Count, Share, Shares
from afferents.models.model import SpeedFrom
from afferents.reporting.page import render_tables
from afferents.reporting.tables import make_table, render_markdown

SUFFIX = ".jsonl"
ENTRIES = "entries"
"""Folder of entries inside the folder of `benchmark run --out`."""
_AN_ENTRY = "an entry of the benchmark"


class Own(BaseModel):
    """A model of somebody's own: where it was found, and SHA-256 of that file."""

    where: str
    sha256: str


class Worst(BaseModel):
    """What was held out where accuracy is lowest."""

    group: str
    accuracy: Share


class Data(BaseModel):
    """What was tested on."""

    fingerprint: str
    recordings: Count
    simulated: bool


class Entry(BaseModel):
    """What came out for a model on a task, `nested`.

    Accuracies are shares of samples recognised, mean over what was held out.

    Attributes
    ----------
    task, task_title, folds
        Name and title, and checksum over what was tested when. Entries of one name are comparable.
    told_speed
        By whom it is told the speed of what is tested, if by anybody.
    ci95, replicate, n_replicates
        95% interval of the mean, what it is drawn over, and how many of these there are.
    by
        Accuracy by what was held out.
    by_touch
        Accuracy by seconds of touch; null where samples are longer, or recordings shorter.
    whole
        Accuracy of whole recordings: what models are ranked by, for it does not depend on how long
        a model's samples are.
    sample_s, encodings
        How long a sample is (median), s, and how samples are made, by name of the encoding.
    seconds_to_90
        The shortest touch, s, of which 90% are recognised; null where none of those tried is.
    ece
        Expected calibration error; null where it gives no probabilities.
    train_samples, train_seconds, prediction_ms
        Samples learnt from and seconds of training, mean over folds; milliseconds for one sample
        alone (median), null where it can't be asked so.
    controls
        Accuracy once something was taken from all recordings; see `folds.controls.CONTROLS`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    schema_version: Literal[1] = Field(1, alias="schema")
    task: str
    task_title: str
    folds: str
    model: str
    title: str
    own: Own | None
    told_speed: SpeedFrom
    preset: str
    seeds: tuple[int, ...]
    mean: Share
    ci95: Shares
    replicate: str
    n_replicates: Count
    chance: Share
    worst: Worst
    by: dict[str, Share]
    by_touch: dict[str, Share | None]
    whole: Share
    sample_s: Amount
    encodings: dict[str, Any]
    seconds_to_90: Amount | None
    ece: Share | None
    train_samples: Annotated[float, Field(ge=1)]
    train_seconds: Amount
    prediction_ms: Amount | None
    controls: dict[str, Share]
    data: Data
    versions: dict[str, str]
    machine: str
    date: str
    command: str

    @classmethod
    def parse(cls, line: str, where: object) -> Self:
        """Read an entry's line.

        Raises
        ------
        InputError
            If it is none, naming the key.
        """
        return as_form(parse_json(line, where, _AN_ENTRY), cls, where, _AN_ENTRY)

    @property
    def line(self) -> str:
        """The entry as a line of JSON."""
        return json.dumps(self.model_dump(mode="json", by_alias=True), ensure_ascii=False)

    def write(self, folder: Path, mark: str) -> Path:
        """Write it to a file of its own, named by task, what tells its data, and model.

        An earlier one of the same is replaced.
        """
        task = self.task.partition("@")[0].replace("/", "-")
        path = folder / f"{task}-{mark}--{self.model}{SUFFIX}"
        folder.mkdir(parents=True, exist_ok=True)
        write_text(path, f"{self.line}\n")
        return path


def read_entries(folder: Path) -> list[Entry]:
    """Read all entries of a folder, or of its folder `ENTRIES`: by task, best first.

    Raises
    ------
    InputError
        If there are none, or a line is none.
    """
    files = list(folder.glob(f"*{SUFFIX}")) or list((folder / ENTRIES).glob(f"*{SUFFIX}"))
    found = [
        Entry.parse(line, f"{path}, line {number}")
        for path in sorted(files)
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if line.strip()
    ]
    if not found:
        raise InputError(
            f"{folder}: expected entries (*{SUFFIX}), found none; make some with "
            "'afferents benchmark run'"
        )
    return sorted(found, key=lambda entry: (entry.task, -entry.whole, entry.model))


_ACCURACY = (
    "told", "whole", "mean", "95%", "sample, s", "0.1 s", "0.5 s", "1 s", "4 s", "90% at, s",
    "worst",
)  # fmt: skip
_COSTS = (*CONTROLS, "calibration", "samples", "training, s", "prediction, ms")


def table(entries: Iterable[Entry]) -> pd.DataFrame:
    """Return a row an entry, of any tasks; accuracies in percent."""
    rows = [
        (entry.task, entry.model, *_list_accuracies(entry), *_list_costs(entry))
        for entry in entries
    ]
    return pd.DataFrame(rows, columns=["task", "model", *_ACCURACY, *_COSTS])


def tables_by_task(entries: Iterable[Entry]) -> Iterator[pd.DataFrame]:
    """Yield tables as pages print them: all tasks at a glance, then two for each task.

    Those of a task are its accuracy, and controls and cost. One task needs no glance.
    """
    by_task: dict[str, list[Entry]] = {}
    for entry in sorted(entries, key=lambda entry: -entry.whole):
        by_task.setdefault(entry.task, []).append(entry)
    if len(by_task) > 1:  # percent by model and task, the best anywhere first
        tasks = sorted(by_task)
        shares: dict[str, dict[str, float]] = {}
        for name, its in by_task.items():
            for entry in its:
                shares.setdefault(entry.model, {})[name] = 100 * entry.whole
        rows = [
            (model, *(f"{of[name]:.0f}" if name in of else None for name in tasks))
            for model, of in sorted(shares.items(), key=lambda one: -max(one[1].values()))
        ]
        caption = "Percent of whole recordings recognised."
        yield make_table("All tasks", caption, ("model", *tasks), rows)
    for name, its in sorted(by_task.items()):
        one = its[0]
        few = ", so few that they say little" if one.n_replicates < _FEW else ""
        note = " Other recordings than the task is sealed with, if it is." * ("@" in name)
        yield _make_printed(
            f"{name}: {one.task_title}",
            f"{one.data.recordings} recordings{' (simulated)' if one.data.simulated else ''}; "
            f"percent recognised, chance {100 * one.chance:.1f}; intervals over "
            f"{one.n_replicates} {one.replicate}s{few}.{note}",
            _ACCURACY,
            [(entry.model, *_list_accuracies(entry)) for entry in its],
        )
        yield _make_printed(
            f"{name}: controls and cost",
            "Percent recognised with labels permuted, time shuffled, offsets or amplitudes alone; "
            "calibration error in percent.",
            _COSTS,
            [(entry.model, *_list_costs(entry)) for entry in its],
        )


_FEW = 10
"""Replicates below which an interval is wide, whatever it says."""


def _make_printed(
    title: str, caption: str, columns: Sequence[str], rows: Sequence[tuple[Any, ...]]
) -> pd.DataFrame:
    """Return a table without the columns that no entry has anything in."""
    kept = [n for n in range(1, len(columns) + 1) if any(cells[n] is not None for cells in rows)]
    shown = [
        (cells[0], *(f"{c:g}" if isinstance(c := cells[n], int | float) else c for n in kept))
        for cells in rows
    ]
    return make_table(title, caption, ("model", *(columns[n - 1] for n in kept)), shown)


def _list_accuracies(entry: Entry) -> tuple[Any, ...]:
    low, high = entry.ci95
    return (
        {"none": "no", "given": "yes", "measured": "itself"}[entry.told_speed],
        _round_percent(entry.whole),
        _round_percent(entry.mean),
        f"{100 * low:.0f}–{100 * high:.0f}",
        round(entry.sample_s, 2),
        *(_round_percent(entry.by_touch.get(length)) for length in ("0.1", "0.5", "1", "4")),
        entry.seconds_to_90,
        f"{entry.worst.group}: {100 * entry.worst.accuracy:.0f}",
    )


def _list_costs(entry: Entry) -> tuple[Any, ...]:
    ms = entry.prediction_ms
    return (
        *(_round_percent(entry.controls.get(name)) for name in CONTROLS),
        _round_percent(entry.ece),
        round(entry.train_samples),
        round(entry.train_seconds, 2),
        None if ms is None else float(f"{ms:.2g}"),
    )


def _round_percent(share: float | None) -> float | None:
    return None if share is None else round(100 * share, 1)


def write_table(entries: Iterable[Entry], folder: Path) -> list[Path]:
    """Write all entries as ``table.md``, ``table.csv`` and a page, ``table.html``."""
    there = list(entries)
    tables = list(tables_by_task(there))
    texts = {
        "table.md": "\n".join(map(render_markdown, tables)),
        "table.csv": table(there).to_csv(index=False),
        "table.html": render_tables("Benchmark", tables),
    }
    require_free(folder, holds_only(*texts))
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in texts]

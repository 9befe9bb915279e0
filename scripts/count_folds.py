"""Keep of finished folds what the tables of docs/results.md need, and print those tables.

    python scripts/count_folds.py keep RESULTS docs/counts/rig-fast.jsonl
    python scripts/count_folds.py table docs/counts/rig-fast.jsonl
    python scripts/count_folds.py compare docs/counts/rig-fast.jsonl docs/counts/rig-paper.jsonl

Predictions and weights of a whole evaluation take a gigabyte. A line a fold is kept of them: model,
protocol, seed, held-out speed, samples learnt from, those gone forward and backward, epochs,
precision, the accuracy of the validation after each epoch, and for each recording how many of its
test samples were named rightly, and of how many. `keep` adds lines to those that are there, so
seeds may come from several machines.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents.evaluation.fold_files import finished_keys, load_fold
from afferents.evaluation.intervals import (
    Accuracy,
    bootstrap_interval,
    count_right,
    interval_of,
    paired_difference,
)
from afferents.files import write_aside
from afferents.models.model import MODELS, TABLE1
from afferents.reporting.published import published_families

NAMES = ("model", "protocol", "seed", "held_out_mm_s")
FACTS = ("n_train", "passes", "epochs", "precision")

Line = dict[str, Any]


def keep(results: Path, out: Path) -> None:
    """Add the finished folds of a results folder to a file, in the place of those of their name."""
    lines = {name_of(line): line for line in read(out)} if out.exists() else {}
    for line in lines_of(results):
        lines[name_of(line)] = line
    models = list(MODELS)
    ordered = sorted(lines.values(), key=lambda a: (models.index(a["model"]), *name_of(a)[1:]))
    with write_aside(out) as partial:
        partial.write_text("".join(json.dumps(line) + "\n" for line in ordered), encoding="utf-8")


def lines_of(results: Path) -> Iterator[Line]:
    """Count the folds of a results folder."""
    for key in finished_keys(results):
        facts, predictions = load_fold(results, key)
        counts = count_right(predictions).set_index("recording")[["right", "n"]]
        yield {
            **{name: facts.get(name) for name in (*NAMES, *FACTS)},
            "validation": [round(e["validation_accuracy"], 4) for e in facts.get("history", [])],
            "right_of": counts.T.to_dict("list"),
        }


def read(path: Path) -> list[Line]:
    """Read the lines of a file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def name_of(line: Line) -> tuple[Any, ...]:
    """Return what a fold is told by."""
    return tuple(line[name] for name in NAMES)


def those_of(lines: Sequence[Line], model: str, protocol: str) -> list[Line]:
    """Return the folds of a model under a protocol."""
    return [line for line in lines if (line["model"], line["protocol"]) == (model, protocol)]


def accuracy_of(lines: Sequence[Line]) -> Accuracy:
    """Return the accuracies of folds, to be drawn from as the report does."""
    rows = [
        (line["held_out_mm_s"], recording, texture_of(recording), line["seed"], right, n)
        for line in lines
        for recording, (right, n) in line["right_of"].items()
    ]
    columns = ["held_out_speed_mm_s", "recording", "unit", "seed", "right", "n"]
    return Accuracy.of_counts(pd.DataFrame(rows, columns=columns))


def texture_of(recording: str) -> str:
    """Return the texture of a recording, the folder that it lies in: of `3/50` it is `3`."""
    return recording.rpartition("/")[0]


def table(lines: Sequence[Line]) -> Iterator[str]:
    """Yield both protocols' table, percent, with columns for the speeds held out."""
    speeds = sorted({line["held_out_mm_s"] for line in lines})
    of_speed = " | ".join(f"{speed:g}" for speed in speeds)
    yield (
        "| model | paper, its own recordings | rig, `published` | rig, `nested` "
        f"| {of_speed} mm/s | published minus nested |"
    )
    yield "|---" * (len(speeds) + 5) + "|"
    for model in TABLE1:
        both = [those_of(lines, model, protocol) for protocol in ("nested", "published")]
        if not all(both):
            continue
        nested, published = map(accuracy_of, both)
        added = paired_difference(published, nested)
        cells = [
            MODELS[model].title,
            f"{published_families()[model].mean_percent}",
            with_interval(published.mean(), bootstrap_interval(published)),
            with_interval(nested.mean(), bootstrap_interval(nested)),
        ]
        cells += at_each(nested, speeds)
        cells.append(with_interval(added.difference, added.ci95, sign="+"))
        yield f"| {' | '.join(cells)} |"


def in_both(*sides: Sequence[Line]) -> list[list[Line]]:
    """Return of each side the folds that all sides have."""
    common = set.intersection(*({name_of(line) for line in side} for side in sides))
    return [[line for line in side if name_of(line) in common] for side in sides]


def compare(fast: Sequence[Line], paper: Sequence[Line]) -> Iterator[str]:
    """Yield what `fast` and `paper` give on the folds that both have, percent."""
    yield (
        "| model | protocol | held out, mm/s | `paper` | at each | `fast` | at each "
        "| `fast` minus `paper` | passes, `paper` | passes, `fast` | times fewer |"
    )
    yield "|---" * 11 + "|"
    sides = in_both(fast, paper)
    models = dict.fromkeys((a["model"], a["protocol"]) for a in sides[0])
    for model, protocol in models:
        of_model = [those_of(side, model, protocol) for side in sides]
        speeds = [line["held_out_mm_s"] for line in of_model[0]]
        fast_each, paper_each = (
            ", ".join(at_each(accuracy_of(lines), speeds)) for lines in of_model
        )
        names = MODELS[model].title, protocol, ", ".join(f"{speed:g}" for speed in speeds)
        yield compared(names, (paper_each, fast_each), [of_model])
    if len(models) > 1:
        every = [[those_of(side, *model) for side in sides] for model in models]
        yield compared(("all of these", "", ""), ("", ""), every)


def at_each(accuracy: Accuracy, speeds: Sequence[float]) -> list[str]:
    """Return the accuracy at each speed, percent."""
    of_speeds = (accuracy.counts[speed].sum(axis=(0, 1)) for speed in speeds)
    return [f"{100 * right / n:.0f}" for right, n in of_speeds]


def compared(
    names: Sequence[str], each: Sequence[str], models: Sequence[Sequence[Sequence[Line]]]
) -> str:
    """Return a row: the mean over models of folds with `paper` and with `fast`, and all passes.

    Parameters
    ----------
    each
        What stands beside the means of `paper` and `fast`.
    models
        The lines of `fast` and of `paper` for each model.
    """
    fast, paper = ([accuracy_of(lines) for lines in side] for side in zip(*models, strict=True))
    passes = [
        sum(line["passes"] for lines in side for line in lines)
        for side in zip(*models, strict=True)
    ]
    means = [np.mean([a.mean() for a in side]) for side in (paper, fast)]
    drawn = [np.mean([a.resampled() for a in side], axis=0) for side in (paper, fast)]
    n = len(fast[0].units)
    more = means[1] - means[0]
    cells = [
        *names,
        *(
            f"{with_interval(mean, interval_of(mean, draws, n))} | {beside}"
            for mean, draws, beside in zip(means, drawn, each, strict=True)
        ),
        with_interval(more, interval_of(more, drawn[1] - drawn[0], n, lowest=-1), sign="+"),
        f"{passes[1]:,}", f"{passes[0]:,}", f"{passes[1] / passes[0]:.1f}",
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def with_interval(mean: float, interval: tuple[float, float], sign: str = "") -> str:
    """Return a mean and its 95% interval, percent."""
    numbers = (mean, *interval)
    a, low, high = (f"{100 * x:{sign}.1f}" for x in numbers)
    return f"{a} [{low}, {high}]"


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["keep", results, out]:
            keep(Path(results), Path(out))
        case ["table", counts]:
            print("\n".join(table(read(Path(counts)))))
        case ["compare", *both] if len(both) == 2:
            print("\n".join(compare(*(read(Path(one)) for one in both))))
        case _:
            sys.exit(__doc__)

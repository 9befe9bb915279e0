"""Draw the tables in the docs from the data in `docs/results` and from the code.

Part of ``make results-pages``:

    python scripts/results_pages.py
    python scripts/results_pages.py keep RESULTS docs/results/NAME.json TITLE COMMAND [COMMAND ...]

A page holds ``<!-- results NAME -->`` and ``<!-- /results -->``; what stands between them is made
of ``docs/results/NAME.json``: the table, and below it the commit, date, machine and commands that
gave the numbers. Between ``<!-- table NAME -->`` and ``<!-- /table -->`` stands the table alone.
`keep` makes such a file of what `afferents evaluate` left. Between ``<!-- fields MODEL -->`` and
``<!-- /fields -->`` stand the fields of a model of the results. Between ``<!-- benchmark -->`` and
``<!-- /benchmark -->`` stands the table of all tasks, between ``<!-- controls TASK -->``
and ``<!-- /controls -->`` those of a task with its controls alone. Between ``<!-- code NAME -->``
and ``<!-- /code -->`` stands what the package has of models, channels, encodings or classifiers.
"""

import inspect
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from datetime import date
from pathlib import Path
from typing import Any

import afferents
from afferents.benchmark.entries import read_entries, tables_by_task
from afferents.doctor import processor
from afferents.evaluation import fold_files, results as schemas
from afferents.files import write_text
from afferents.reporting.published import published_families
from afferents.reporting.tables import render_markdown

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
DATA = DOCS / "results"


def fill(page: str, mark: str, write: Callable[[str], str]) -> str:
    """Return a page with what stands between its marks written anew.

    Parameters
    ----------
    page
        Its text, in Markdown.
    mark
        Name of the marks: ``<!-- MARK NAME -->`` begins a part, and ``<!-- /MARK -->`` ends it.
    write
        Takes the NAME and returns what is to stand there.
    """
    between = rf"(<!-- {mark} ?([\w-]*) -->\n).*?(<!-- /{mark} -->)"
    return re.sub(between, lambda found: found[1] + write(found[2]) + found[3], page, flags=re.S)


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def part(name: str, data: Path = DATA) -> str:
    """Return a table and what gave its numbers."""
    found = json.loads((data / f"{name}.json").read_text())
    rows = [[str(cell) for cell in row] for row in found["rows"]]
    head = found["columns"]
    if found.get("published"):
        paper = published_families()
        head = [head[0], "the paper's own", *head[1:]]
        rows = [[f"`{row[0]}`", f"{paper[row[0]].mean_percent}", *row[1:]] for row in rows]
    several = "s" * ("; " in found["commit"])
    commits = found["commit"].replace("; ", "`, `")
    source = f"Commit{several} `{commits}`, {found['date']}, {found['machine']}:"
    commands = "\n".join(found["commands"])
    return f"{table(head, rows)}\n{source}\n\n```\n{commands}\n```\n"


def bare(name: str) -> str:
    """Return a table alone, of which another page says where its numbers come from."""
    found = json.loads((DATA / f"{name}.json").read_text())
    return table(found["columns"], found["rows"])


def fields(name: str) -> str:
    """Return the fields of a model of the results."""
    model = getattr(schemas, name, None) or getattr(fold_files, name)
    rows = [
        [f"`{field.alias or key}`", " ".join((field.description or "").split())]
        for key, field in model.model_fields.items()
    ]
    return table(["field", "what it is"], rows)


def listed(name: str) -> str:
    """Return the table of all models, channels, encodings, or classifiers."""
    if name != "models":
        head, named = ["name", "what it is"], getattr(afferents, name.upper())
        return table(head, [[f"`{key}`", f"{first_sentence(one)}."] for key, one in named.items()])
    rows = []
    for model in afferents.MODELS.values():
        parts = [afferents.MODELS[part] for part in model.parts] or [model]
        used = (in_code(part.channel for part in parts), in_code(part.encoding for part in parts))
        rows.append([f"`{model.name}`", model.title, *used, in_code([model.classifier])])
    return table(["model", "in tables", "channel", "encoding", "classifier"], rows)


def first_sentence(thing: object) -> str:
    """Return the first line of a docstring, without the full stop."""
    kind = thing if inspect.isclass(thing) else type(thing)
    return (kind.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ").removesuffix(".")


def in_code(names: Iterable[str]) -> str:
    """Return names, each once, as a page sets them."""
    return ", ".join(f"`{name}`" for name in dict.fromkeys(names))


def benchmark(_: str) -> str:
    """Return the table of all tasks at a glance, of the entries in the repository."""
    return render_markdown(next(iter(tables_by_task(read_entries(DOCS / "benchmark")))))


def controls(task: str) -> str:
    """Return what models recognise on a task of the benchmark, and under its controls."""
    head = ["model", "as they are", "values in any order", "loudness alone", "offsets alone"]
    entries = [one for one in read_entries(DOCS / "benchmark") if named(one.task) == task]
    rows = []
    for one in sorted(entries, key=lambda entry: -entry.whole):
        left = [one.controls[name] for name in ("shuffled", "amplitudes", "offsets")]
        rows.append([f"`{one.model}`", *(f"{100 * share:.0f}" for share in (one.whole, *left))])
    return table(head, rows)


def named(task: str) -> str:
    """Return the name of a task as marks have it: without the checksum of other recordings."""
    return task.partition("@")[0].replace("/", "-")


def pages() -> dict[Path, str]:
    """Return the text of each page, with its tables as data and code have them."""
    found = {}
    for page in sorted([*DOCS.glob("*.md"), ROOT / "README.md"]):
        found[page] = fill(fill(page.read_text(), "results", part), "fields", fields)
        found[page] = fill(fill(found[page], "table", bare), "benchmark", benchmark)
        found[page] = fill(fill(found[page], "code", listed), "controls", controls)
    return found


def keep(results: Path, out: Path, title: str, commands: list[str]) -> None:
    """Make a data file of what `evaluate` left: accuracies, in the mean and of each group."""
    summary = schemas.Summary.read(results / "summary.json", "a summary of results")
    rows = []
    for model, outcomes in summary.models.items():
        for protocol, one in outcomes.items():
            mean, low, high = (100 * share for share in (one.mean_accuracy, *one.ci95))
            each = [f"{100 * accuracy:.0f}" for accuracy in one.by.values()]
            rows.append(
                [f"`{model}`", f"`{protocol}`", f"{mean:.1f} [{low:.1f}, {high:.1f}]", *each]
            )
    columns = ["model", "protocol", "mean", *summary.held_out_keys]
    write(out, title, commands, columns, rows)


def write(
    out: Path, title: str, commands: list[str], columns: list[str], rows: list[list[str]]
) -> None:
    """Write a data file: a table and where it comes from."""
    found = {"title": title, **source(commands), "columns": columns, "rows": rows}
    write_json(out, found)


def source(commands: list[str]) -> dict[str, Any]:
    """Return where numbers come from: this commit, day, machine, and the commands."""
    return {
        "commit": output("git", "rev-parse", "--short", "HEAD"),
        "date": f"{date.today()}",
        "machine": f"{processor()}, {os.cpu_count()} cores",
        "commands": commands,
    }


def find_sources(parts: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return commits, days and machines of the parts of a table, each once."""
    every = list(parts)
    return {
        key: "; ".join(dict.fromkeys(one for part in every for one in part[key].split("; ")))
        for key in ("commit", "date", "machine")
    }


def write_json(out: Path, found: dict[str, Any]) -> None:
    """Write a data file as they all are, whole or not at all."""
    write_text(out, json.dumps(found, indent=1, ensure_ascii=False) + "\n")


def output(*command: str) -> str:
    """Return what a command in the checkout prints."""
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout[:-1]


if __name__ == "__main__":
    match sys.argv[1:]:
        case []:
            for path, text in pages().items():
                path.write_text(text)
        case ["keep", results, out, title, *commands] if commands:
            keep(Path(results), Path(out), title, commands)
        case _:
            sys.exit(__doc__)

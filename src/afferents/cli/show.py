"""What commands print of what their functions return: a function for each, by the command's name.

Each is given what was returned, and what the command was given, by argument.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from textwrap import indent
from typing import Any

from rich.text import Text

from afferents.cli.command import Output
from afferents.cli.printing import list_rows, once_a_kind
from afferents.models.model import TABLE1

Given = Mapping[str, Any]


def fetch(found: Any, given: Given) -> Output:
    from afferents.recordings.fetch import public_sets

    folder = found.folder
    then = public_sets()[given["name"]].next_step.format(folder=folder)
    here = f"{found.fetched} files fetched, {found.kept} were here: {folder}"
    return Output({**vars(found), "folder": str(folder)}, [here, f"Next: {then}"])


def import_(checks: Any, given: Given) -> Output:
    session = given["session"]
    content = {"session": str(session), "checks": [line.as_json() for line in checks]}
    return Output(content, [*(line.describe() for line in checks), f"Session: {session}"])


def init(made: Any, given: Given) -> Output:
    what = "Session file" if made.path.name == "session.toml" else "Description"
    content = {"session_file": str(made.path), "said": made.sentences}
    return Output(content, [*made.sentences, f"{what} to check: {made.path}"])


def inspect(found: Any, given: Given) -> Output:
    rows = [
        (topic * (sentence is its[0]), sentence)
        for topic, its in found.topics.items()
        for sentence in its
    ]
    problems = [f"Problem: {problem}" for problem in once_a_kind(found.problems)]
    lines = [found.source, list_rows("", ("", ""), rows), "", *problems, *_pictures(found)]
    names = ("source", "sentences", "problems", "pictures", "facts")
    content = {name: getattr(found, name) for name in names}
    return Output(content, lines, is_bad=bool(found.problems))


def calibrate(found: Any, given: Given) -> Output:
    sentences, picture = found
    content = {"sensor": str(given["out"]), "picture": str(picture), "said": sentences}
    end = [f"Sensor file: {given['out']}", f"Picture to check: {picture}"]
    return Output(content, [*sentences, *end])


def align(found: Any, given: Given) -> Output:
    return Output(found._asdict(), found.describe())


def track(sentences: Any, given: Given) -> Output:
    out = given["out"]
    return Output({"store": str(out), "said": sentences}, [*sentences, f"Store: {out}"])


def extract(extracted: Any, given: Given) -> Output:
    from afferents.extraction.copies import read_notes

    out, skipped = given["out"], extracted.skipped
    store = str(out) if extracted else None
    content = {"store": store, "skipped": skipped, **asdict(read_notes(out))}
    return Output(content, [f"Store: {out}"] * bool(extracted), skipped)


def evaluate(results: Any, given: Given) -> Output:
    from afferents.reporting import labels, tables

    summary, lines = results.found, []
    caution = labels.caption("caution", summary)  # written once, not below each table
    for table in (
        tables.short_table1(summary) if summary.models.keys() & TABLE1.keys() else None,
        tables.recordings_table(summary) if summary.models.keys() - TABLE1.keys() else None,
        tables.lengths_table(summary),
        tables.touches_table(summary),
    ):
        if table is not None:
            table.attrs["caption"] = table.attrs["caption"].removesuffix(caution).rstrip()
            lines += [table, ""]
    lines += [Text(caution), ""] if caution else []
    return Output(results.summary, [*lines, f"Results: {given['out']}"], _skipped(summary))


def reproduce(results: Any, given: Given) -> Output:
    from afferents.reporting import tables, text

    summary, page = results.found, results.root / "report.html"
    found = Text(text.headline(summary))  # wrapped between words, as the caption above it
    lines = ["", text.describe_held_out(summary), found, "", f"Report: {page.resolve()}"]
    steps = text.list_next_steps(summary, results.root)
    if commands := [step.command for step in steps if step.command]:
        lines += ["Next:", indent(commands[-1], "  ")]
    return Output(results.summary, [tables.short_table1(summary), *lines], _skipped(summary))


def train(card: Any, given: Given) -> Output:
    return Output(card.model_dump(mode="json"), [*card.describe(), f"Model: {given['out']}"])


def explain(found: Any, given: Given) -> Output:
    return Output(found.facts, [*found.sentences, *_pictures(found)])


def neural(found: Any, given: Given) -> Output:
    return Output(
        found.facts, [line for table in found.summary for line in (table, "")] + _pictures(found)
    )


def export(path: Any, given: Given) -> Output:
    from afferents.models.card import CARD, read_card

    card = read_card(given["model"] / CARD)
    return Output(card.model_dump(mode="json"), [*card.describe(), f"ONNX: {path}"])


def export_nwb(path: Any, given: Given) -> Output:
    return Output({"nwb": str(path)}, [f"NWB: {path}"])


def export_mcap(bags: Any, given: Given) -> Output:
    lines = [f"Bag: {bag}" for bag in bags[:3]]
    more = [f"and {len(bags) - 3} more in {given['out']}"] * (len(bags) > 3)
    return Output({"bags": [str(bag) for bag in bags]}, lines + more)


def export_lerobot(n: Any, given: Given) -> Output:
    out = given["out"]
    line = f"LeRobot data set of {n} episodes: {out}"
    return Output({"lerobot": str(out), "episodes": n}, [line])


def view(logged: Any, given: Given) -> Output:
    lines = [f"{entity}: {number}" for entity, number in logged.items()]
    save = given.get("save")
    return Output({"logged": logged}, lines + [f"Written: {save}"] * bool(save))


def simulate(session: Any, given: Given) -> Output:
    path = given["session"]
    return Output({"session": str(path)}, [f"Session (simulated): {path}"])


def drum(path: Any, given: Given) -> Output:
    return Output({"stl": str(path)}, [f"STL, in mm: {path}"])


def benchmark_run(entries: Any, given: Given) -> Output:
    from afferents.benchmark.entries import tables_by_task

    content = [entry.model_dump(mode="json", by_alias=True) for entry in entries]
    folder = given.get("out", Path("benchmark")) / "entries"
    return Output({"entries": content}, [*tables_by_task(entries), f"Entries: {folder}"])


def benchmark_seal(found: Any, given: Given) -> Output:
    of_data = f", data {found.fingerprint[:8]}" if found.fingerprint else ""
    lines = [
        f"{given['task']} now says what is tested: folds {found.folds[:8]}{of_data}.",
        "Run it again for entries under its name; what is finished is not trained again.",
    ]
    return Output(found._asdict(), lines)


def _pictures(found: Any) -> list[str]:
    return [f"Picture: {path}" for path in found.pictures]


def _skipped(summary: Any) -> dict[str, str]:
    return {entry.recording: entry.reason for entry in summary.skipped}

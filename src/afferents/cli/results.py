"""Commands on folders of results: status, report, and those of the benchmark that only read."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from rich.text import Text

from afferents.choices import Figures
from afferents.cli.command import Output
from afferents.cli.printing import list_rows, put_apart


def status(results: Path) -> Output:
    """Show how far an evaluation is, or a reproduction: done, running, failed, and when it ends.

    Parameters
    ----------
    results
        Folder that 'evaluate' or 'reproduce' writes, running or not.
    """
    from afferents.reporting.tables import make_table
    from afferents.reproduction import status as looking

    found = looking.status(results)
    table = make_table("", "", ("model", "protocol", *looking.STATES), found.rows, n_headers=2)
    return Output(found.facts, [table, *found.sentences])


def report(results: Sequence[Path], figures: Figures = "report", quiet: bool = False) -> Output:
    """Write a page (report.html) with tables and figures for each results folder.

    With several folders, their accuracies are also put side by side in one table.

    Parameters
    ----------
    results
        Results folders that 'evaluate' wrote.
    figures
        How the paper's figures are drawn: as suits what was evaluated ('report'), or as they are
        printed, 7 to 13 ('paper').
    quiet
        No progress bars; plain lines on stderr.
    """
    import afferents
    from afferents.reporting.report import compare_runs

    table, written = compare_runs(results)  # which refuses some, before minutes of drawing
    pages = [afferents.report(folder, quiet, figures) for folder in results]
    content = {"reports": [str(page) for page in pages], "table": str(written)}
    return Output(content, [table, *(f"Report: {page}" for page in pages), f"Table: {written}"])


def discrepancies() -> Output:
    """List where the paper's text and its code differ, and what is done here."""
    from afferents.reporting import published

    points, sections = published.list_discrepancies(), published.list_sections()
    about = (
        f"The paper's text and the authors' code, compared in {len(points)} points. A: changes "
        "numbers, or what they mean; B: changes a reproduction; C: wording or labels. Here, the "
        "code is followed where no cell says otherwise.\n"
    )
    heads = ("", "What differs", "Paper", "Code", "Here")
    tables = [
        list_rows(
            area, heads, [(f"{one.number} {one.matters}", one.topic, *one.columns) for one in its]
        )
        for area, its in groupby(points, lambda one: one.area)
    ]
    tables += [list_rows(title, ("", ""), rows) for title, rows in sections.items()]
    return Output({"discrepancies": published.discrepancies()}, [Text(about), *put_apart(tables)])


def benchmark() -> Output:
    """Compare models of texture on tasks that are the same for all: list tasks and their data.

    Of the data it says what they are, what is here, what to fetch, and the licence.
    """
    from afferents.benchmark.tasks import FOLDER, all_tasks, data_infos

    there, infos = all_tasks(), data_infos()
    data, bring = [], []
    for name, info in infos.items():
        is_here = (FOLDER / name).is_dir()
        here = "yes" if is_here else "made" if info.made else "no"
        data.append((name, info.title, f"{info.size}; {info.licence}", here))
        bring += [] if is_here or info.made else [info.get.format(folder=FOLDER / name)]
    tasks = [(name, task.title) for name, task in there.items()]
    heads = ("Name", "What it is", "Size; licence", "Here")
    tables = (
        list_rows("Tasks", ("Name", "What is asked"), tasks),
        list_rows(f"Data, in {FOLDER}/NAME", heads, data),
    )
    lines = [*put_apart(tables), *(["What brings the data:", *bring, ""] if bring else [])]
    lines.append("Run one: afferents benchmark run TASK --models MODEL,FILE.py:NAME")
    content = {
        "tasks": {name: task.model_dump() for name, task in there.items()},
        "data": {name: info.model_dump() for name, info in infos.items()},
    }
    return Output(content, lines)


def benchmark_table(folder: Path = Path("benchmark"), out: Path | None = None) -> Output:
    """Gather all entries of a folder into a table for each task.

    Parameters
    ----------
    folder
        Folder that 'benchmark run --out' wrote, or of entries.
    out
        Folder for table.md, table.csv and table.html.
    """
    from afferents.benchmark import entries

    found = entries.read_entries(folder)
    written = entries.write_table(found, out) if out else []
    content = [entry.model_dump(mode="json", by_alias=True) for entry in found]
    lines = [*entries.tables_by_task(found), *(f"Written: {path}" for path in written)]
    return Output({"entries": content}, lines)

"""Commands of the benchmark: list tasks, run models on one, gather entries, fix a task's folds."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.choices import PRESET_ASKED, Preset
from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet, Workers

benchmark = typer.Typer(
    help="Compare models of texture on tasks that are the same for all.",
    invoke_without_command=True,
)

TaskName = Annotated[
    str, typer.Argument(metavar="TASK", help="Name of a task, or a TOML file of your own.")
]
DataFolder = Annotated[
    Path | None,
    typer.Option(help="Folder of the task's data set (default: data/NAME in the current folder)."),
]


@benchmark.callback()
def list_tasks(context: typer.Context, as_json: Json = False) -> None:
    """List tasks and their data: what they are, what is here, what to fetch, and the licence."""
    if context.invoked_subcommand is not None:
        return
    from afferents.benchmark.tasks import FOLDER, all_tasks, data_infos
    from afferents.reporting.tables import make_table

    there, infos = all_tasks(), data_infos()
    of_tasks = make_table(
        "Tasks",
        "Run one with: afferents benchmark run TASK --models MODEL,FILE.py:NAME",
        ("Task", "What is asked", "Held out"),
        [(name, task.title, task.chosen.split) for name, task in there.items()],
    )
    of_data = make_table(
        "Data",
        "",
        ("Data set", "What it is", "Size", "Licence", "Here"),
        [
            (
                name,
                info.title,
                info.size,
                info.licence,
                _where(FOLDER / name, info.get, bool(info.made)),
            )
            for name, info in infos.items()
        ],
    )
    found = {
        "tasks": {name: task.model_dump() for name, task in there.items()},
        "data": {name: info.model_dump() for name, info in infos.items()},
    }
    say(as_json, found, of_tasks, of_data)


def _where(folder: Path, get: str, is_made: bool) -> str:
    if folder.is_dir():
        return f"in {folder}"
    return "made when it is needed" if is_made else f"no: {get.format(folder=folder)}"


@benchmark.command()
def run(
    task: TaskName,
    models: Annotated[
        str,
        typer.Option(
            help="Names, comma-separated, 'chance' and 'nearest' among them; FILE.py:NAME for one "
            "of your own."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for results and entries.")] = Path("benchmark"),
    data: DataFolder = None,
    preset: Annotated[
        Preset, typer.Option(help="How networks are trained; see 'evaluate'.")
    ] = PRESET_ASKED,
    seeds: Annotated[
        int, typer.Option(min=1, help="How many seeds each model is trained with.")
    ] = 1,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Train and test models on a task, also under controls, and write a line for each."""
    from afferents.benchmark import find_task
    from afferents.benchmark import run as run_task
    from afferents.benchmark.entries import tables_by_task

    asked = find_task(task)
    entries = run_task(asked, models, out, data, preset, seeds, workers, quiet or as_json)
    found = [entry.model_dump(mode="json", by_alias=True) for entry in entries]
    tables = tables_by_task(entries, {asked.name: asked.title})
    say(as_json, {"entries": found}, *tables, f"Entries: {out / 'entries'}")


@benchmark.command()
def table(
    folder: Annotated[
        Path, typer.Argument(help="Folder of entries, as 'benchmark run' leaves them.")
    ] = Path("benchmark/entries"),
    out: Annotated[
        Path | None, typer.Option(help="Folder for table.md, table.csv and table.html.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Gather all entries of a folder into a table for each task."""
    from afferents.benchmark import all_tasks, read_entries
    from afferents.benchmark.entries import tables_by_task, write_table

    entries = read_entries(folder)
    titles = {name: task.title for name, task in all_tasks().items()}
    written = write_table(entries, titles, out) if out else []
    found = [entry.model_dump(mode="json", by_alias=True) for entry in entries]
    lines = [f"Written: {path}" for path in written]
    say(as_json, {"entries": found}, *tables_by_task(entries, titles), *lines)


@benchmark.command()
def seal(task: TaskName, data: DataFolder = None, as_json: Json = False) -> None:
    """Write into a task's file which recordings it tests when, so that others test on the same."""
    from afferents.benchmark.tasks import seal as seal_task

    found = seal_task(Path(task), data)
    say(as_json, {"folds": found}, f"Folds: {found}")

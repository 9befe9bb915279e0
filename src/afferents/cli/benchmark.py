"""Commands of the benchmark: list tasks, run models on one, gather entries, fix a task's folds."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.choices import PRESET_ASKED, Device, Preset
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

    there, infos = all_tasks(), data_infos()
    lines = ["Tasks (afferents benchmark run TASK --models MODEL,FILE.py:NAME)"]
    lines += [f"  {name:<25} {task.title}" for name, task in there.items()]
    lines += ["", "Data"]
    for name, info in infos.items():
        where = FOLDER / name
        here = "made when it is needed" if info.made else info.get.format(folder=where)
        here = f"in {where}" if where.is_dir() else here
        lines += [f"  {name}: {info.title}", f"    {info.size}; licence: {info.licence}; {here}"]
    found = {
        "tasks": {name: task.model_dump() for name, task in there.items()},
        "data": {name: info.model_dump() for name, info in infos.items()},
    }
    say(as_json, found, *lines)


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
    device: Annotated[
        Device, typer.Option(help="Where networks are trained; 'auto' takes a GPU if there is one.")
    ] = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Train and test models on a task, also under controls, and write a line for each."""
    from afferents.benchmark import run as run_task
    from afferents.benchmark.entries import tables_by_task

    entries = run_task(task, models, out, data, preset, seeds, workers, quiet or as_json, device)
    found = [entry.model_dump(mode="json", by_alias=True) for entry in entries]
    tables = tables_by_task(entries)
    say(as_json, {"entries": found}, *tables, f"Entries: {out / 'entries'}")


@benchmark.command()
def table(
    folder: Annotated[
        Path, typer.Argument(help="Folder that 'benchmark run --out' wrote, or of entries.")
    ] = Path("benchmark"),
    out: Annotated[
        Path | None, typer.Option(help="Folder for table.md, table.csv and table.html.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Gather all entries of a folder into a table for each task."""
    from afferents.benchmark import read_entries
    from afferents.benchmark.entries import tables_by_task, write_table

    entries = read_entries(folder)
    written = write_table(entries, out) if out else []
    found = [entry.model_dump(mode="json", by_alias=True) for entry in entries]
    lines = [f"Written: {path}" for path in written]
    say(as_json, {"entries": found}, *tables_by_task(entries), *lines)


@benchmark.command()
def seal(
    task: Annotated[Path, typer.Argument(help="TOML file of a task of your own.")],
    data: DataFolder = None,
    as_json: Json = False,
) -> None:
    """Write into a task's file which recordings it tests when, so that others test on the same."""
    from afferents.benchmark.tasks import seal as seal_task

    found = seal_task(task, data)
    of_data = f", data {found.fingerprint[:8]}" if found.fingerprint else ""
    lines = [
        f"{task} now says what is tested: folds {found.folds[:8]}{of_data}.",
        "Run it again for entries under its name; what is finished is not trained again.",
    ]
    say(as_json, found._asdict(), *lines)

"""Commands of evaluations: test models at held-out speeds, report, status, the whole way."""

from pathlib import Path
from typing import Annotated, Any

import typer

from afferents.cli.encodings import takes_encodings
from afferents.cli.errors import fail_if_skipped
from afferents.cli.printing import say
from afferents.cli.shared import (
    SEED,
    ClusterName,
    CutName,
    DeviceName,
    Json,
    KeepGoing,
    PrecisionName,
    PresetName,
    ProtocolName,
    Quiet,
    RecipeFile,
    SensorName,
    SteadyPart,
    Workers,
)
from afferents.cli.tables import TerminalTable
from afferents.core.choices import Figures, Penalty, Size
from afferents.core.model import TABLE1
from afferents.core.progress import Progress

LESS = "Less of the data (to see what it costs)"
SPOILT = "Worse data (to see what it costs)"


@takes_encodings
def evaluate(
    data: Annotated[
        list[str],
        typer.Argument(help="Stores that 'extract' wrote, a dataset.toml, or fabricslide:PATH."),
    ],
    out: Annotated[
        Path, typer.Option(help="Results folder to write; folds that are finished in it are kept.")
    ],
    models: Annotated[
        str,
        typer.Option(
            help="Models, comma-separated: names; 'all' of the paper's Table 1; 'best', what we "
            "recommend for such data; FILE.py:NAME for one of your own."
        ),
    ] = "all",
    protocol: ProtocolName = "nested",
    preset: PresetName = "quick",
    recipe: RecipeFile = None,
    cut: CutName = "all",
    seed: Annotated[int, typer.Option(**SEED, help="First random seed.")] = 0,
    seeds: Annotated[
        int, typer.Option(min=1, help="How many seeds each model is trained with.")
    ] = 1,
    split: Annotated[
        str,
        typer.Option(
            help="What is held out: one 'speed' at a time; or one value of a condition that all "
            "recordings carry, such as 'trial'; or a 'texture' as well as a speed, to ask whether "
            "it is recognised as unknown and how coarse it is."
        ),
    ] = "speed",
    held_out: Annotated[
        str | None,
        typer.Option(
            help="Hold out only these speeds, mm/s, or values of the condition that --split names "
            "(default: each in turn)."
        ),
    ] = None,
    steady: SteadyPart = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            help="Leave out recordings with this condition: pressure=F250.", rich_help_panel=LESS
        ),
    ] = None,
    test_only: Annotated[
        str | None,
        typer.Option(
            help="Test only recordings with this condition and train on the others: repetition=1.",
            rich_help_panel=LESS,
        ),
    ] = None,
    textures: Annotated[
        str | None,
        typer.Option(
            help="Use only these textures: folder names or the paper's letters.",
            rich_help_panel=LESS,
        ),
    ] = None,
    speeds: Annotated[
        str | None,
        typer.Option(
            help="Use only these speeds, mm/s: 10,50,100 or 10..100:30.", rich_help_panel=LESS
        ),
    ] = None,
    train_speeds: Annotated[
        int | None,
        typer.Option(
            help="How many speeds each fold trains on (default: all it has).",
            rich_help_panel=LESS,
        ),
    ] = None,
    markers: Annotated[
        float,
        typer.Option(
            help="Share of the markers that tactile images show, evenly spread.",
            rich_help_panel=LESS,
        ),
    ] = 1.0,
    penalty: Annotated[
        Penalty,
        typer.Option(
            help="Penalty of ridges (all models beyond the paper's): the usual one ('fixed'), or "
            "chosen inside each fold by leaving out its training speeds in turn ('searched')."
        ),
    ] = "fixed",
    disturb: Annotated[
        str | None,
        typer.Option(
            help="Spoil the recordings that are tested: markers=0.1 (noise, px), sound=-20dB "
            "(noise, by the sound's own level), frames=0.05 and lost=0.1 (share of the frames "
            "dropped, of the markers lost), seed=0.",
            rich_help_panel=SPOILT,
        ),
    ] = None,
    disturb_training: Annotated[
        str | None,
        typer.Option(
            help="Spoil the recordings that are learnt from, in the same words.",
            rich_help_panel=SPOILT,
        ),
    ] = None,
    workers: Workers = None,
    cluster: ClusterName = None,
    device: DeviceName = "auto",
    precision: PrecisionName = "auto",
    keep_going: KeepGoing = False,
    as_json: Json = False,
    quiet: Quiet = False,
    **encoding: Any,
) -> None:
    """Train and test models on sliding speeds that they have not been trained on.

    Each speed is held out in turn (a fold): the model trains on the others and is tested on it.
    With --split it is each trial, or each value of another condition, instead of each speed.
    """
    from afferents import commands
    from afferents.commands.given import conditions_in
    from afferents.core.split import SPEED, TEXTURE
    from afferents.core.steady import parse_steady
    from afferents.evaluation.ablation import Ablation, parse_speeds

    by_speed = split in (SPEED.name, TEXTURE)
    apart = conditions_in([test_only], "--test-only").popitem() if test_only else None
    asked: dict[str, Any] = {
        "data": data,
        "out": out,
        "models": models,
        "protocol": protocol,
        "preset": preset,
        "recipe": recipe,
        "cut": cut,
        "seeds": range(seed, seed + seeds),
        "held_out": parse_speeds(held_out, "--held-out") if by_speed else _names(held_out),
        "steady": parse_steady(steady),
        "without": conditions_in(without or [], "--without"),
        "only": Ablation(_names(textures), parse_speeds(speeds), markers, train_speeds, apart),
        "penalty": penalty,
        "disturb": disturb,
        "disturb_training": disturb_training,
        "keep_going": keep_going,
        "workers": workers,
        "cluster": cluster,
        "device": device,
        "precision": precision,
        "quiet": quiet or as_json,
        **encoding,
    }
    if split == TEXTURE:
        found: dict[str, Any] = commands.evaluate_textures(**asked)
        tables, skipped = _texture_tables(found), next(iter(found.values()))["skipped"]
    else:
        found = commands.evaluate(**asked, split=split).summary
        tables, skipped = _tables(found), found["skipped"]
    say(as_json, found, *tables, f"Results: {out}")
    fail_if_skipped({entry["recording"]: entry["reason"] for entry in skipped})


def report(
    results: Annotated[list[Path], typer.Argument(help="Results folders that 'evaluate' wrote.")],
    figures: Annotated[
        Figures,
        typer.Option(
            help="How the paper's figures are drawn: as suits what was evaluated ('report'), or "
            "as they are printed, 3 and 5 to 13 ('paper')."
        ),
    ] = "report",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a page (report.html) with tables and figures for each results folder.

    With several folders, their accuracies are also put side by side in one table.
    """
    from afferents import commands
    from afferents.pipeline.report import compare_runs

    pages = [commands.report(folder, quiet or as_json, figures) for folder in results]
    table, written = compare_runs(results)
    found = {"reports": [str(page) for page in pages], "table": str(written)}
    lines = [f"Report: {page}" for page in pages]
    say(as_json, found, TerminalTable.of(table), *lines, f"Table: {written}")


def status(
    results: Annotated[Path, typer.Argument(help="Results folder of 'evaluate', running or not.")],
    as_json: Json = False,
) -> None:
    """Show how far an evaluation is: done, running, failed, and when it will end."""
    from afferents.pipeline.status import STATES
    from afferents.pipeline.status import status as look

    found = look(results)
    table = TerminalTable(("model", "protocol", *STATES), found.rows, n_headers=2)
    say(as_json, found.facts, table, *found.sentences)


def reproduce(
    out: Annotated[
        Path, typer.Argument(help="Folder to write session, store, results and report to.")
    ],
    session: Annotated[
        Path | None, typer.Option(help="Session folder of your own (default: one is simulated).")
    ] = None,
    sensor: SensorName = "tip_b",
    preset: PresetName = "fast",
    size: Annotated[
        Size,
        typer.Option(
            help="Size of the simulated session: 65 recordings of seconds, or the paper's 130 of "
            "a minute."
        ),
    ] = "quick",
    protocol: ProtocolName = "nested",
    cut: CutName = "all",
    seed: Annotated[int, typer.Option(**SEED, help="Random seed of simulation and training.")] = 0,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run the paper's experiment from start to end: simulate, extract, evaluate, report.

    Evaluates the six models of Table 1, and the one that we recommend.
    """
    from afferents.core.protocol import protocols
    from afferents.core.results import read_summary
    from afferents.markers import load_sensor
    from afferents.pipeline.reproduce import Reproduction
    from afferents.pipeline.reproduce import reproduce as run
    from afferents.reporting import headline, table1

    under = tuple(protocols(protocol))
    wanted = Reproduction(
        out, session, load_sensor(sensor), preset, size, under, cut, seed, workers
    )
    with Progress(quiet or as_json) as progress:
        page = run(wanted, progress)
    summary = read_summary(wanted.results)
    said = ("", headline(summary), f"Report: {page.resolve()}")
    say(as_json, summary, TerminalTable.of(table1(summary)), *said)


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",")) if text else ()


def _tables(summary: dict[str, Any]) -> list[TerminalTable]:
    """Return Table 1 where some of its models were evaluated, and what our own came to."""
    from afferents.reporting import by_touch_table, lengths_table, table1, touches_table

    evaluated = set(summary["models"])
    tables = [table1(summary)] if evaluated & set(TABLE1) else []
    tables += [touches_table(summary)] if evaluated - set(TABLE1) else []
    tables += [table for of in (lengths_table, by_touch_table) if (table := of(summary))]
    return [TerminalTable.of(table) for table in tables]


def _texture_tables(summaries: dict[str, Any]) -> list[TerminalTable]:
    from afferents.reporting import texture_tables

    return [TerminalTable.of(table) for table in texture_tables(summaries)]

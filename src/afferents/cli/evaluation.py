"""Commands of evaluations: test models at held-out speeds, report, status."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from afferents.choices import MODELS_ASKED, PRESET_ASKED, Figures, Penalty, conditions_in
from afferents.cli.errors import fail_if_skipped
from afferents.cli.options import takes_encodings
from afferents.cli.printing import TerminalTable, say
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
    StatisticsName,
    SteadyPart,
    Workers,
)
from afferents.models.model import TABLE1

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
            "recommend for such data; 'all,best' for both; FILE.py:NAME for one of your own."
        ),
    ] = MODELS_ASKED,
    protocol: ProtocolName = "nested",
    preset: PresetName = PRESET_ASKED,
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
            "recordings carry, such as 'trial'; or an 'angle' of the drum, in all recordings, of "
            "five ('angle-8': of eight); or a 'texture' as well as a speed, to ask whether "
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
    statistics: StatisticsName = "warmed-up",
    keep_going: KeepGoing = False,
    as_json: Json = False,
    quiet: Quiet = False,
    **encoding: Any,
) -> None:
    """Train and test models on sliding speeds that they have not been trained on.

    Each speed is held out in turn (a fold): the model trains on the others and is tested on it.
    With --split it is each trial, or each value of another condition, instead of each speed.
    """
    import afferents
    from afferents.folds.held_out import TEXTURE

    asked = as_function_takes_it({
        "data": data,
        "out": out,
        "models": models,
        "protocol": protocol,
        "preset": preset,
        "recipe": recipe,
        "cut": cut,
        "seed": seed,
        "seeds": seeds,
        "split": split,
        "held_out": held_out,
        "steady": steady,
        "without": without,
        "test_only": test_only,
        "textures": textures,
        "speeds": speeds,
        "train_speeds": train_speeds,
        "markers": markers,
        "penalty": penalty,
        "disturb": disturb,
        "disturb_training": disturb_training,
        "keep_going": keep_going,
        "workers": workers,
        "cluster": cluster,
        "device": device,
        "precision": precision,
        "statistics": statistics,
        "quiet": quiet or as_json,
        **encoding,
    })  # fmt: skip
    if split == TEXTURE:
        del asked["split"]
        found: dict[str, Any] = afferents.evaluate_textures(**asked)
        tables, skipped = _texture_tables(found), next(iter(found.values()))["skipped"]
    else:
        found = afferents.evaluate(**asked).summary
        tables, skipped = _tables(found), found["skipped"]
    say(as_json, found, *tables, f"Results: {out}")
    fail_if_skipped({entry["recording"]: entry["reason"] for entry in skipped})


def as_function_takes_it(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options of evaluate, as a command line gives them, as its function takes them.

    Those that are not there are left to the function, and so are their defaults.
    """
    from afferents.folds.ablation import Ablation, parse_speeds
    from afferents.folds.held_out import SPEED, TEXTURE
    from afferents.store.trimming import parse_steady

    given = {name: value for name, value in options.items() if value is not None}
    seed, n_seeds = given.pop("seed", 0), given.pop("seeds", 1)
    apart = given.pop("test_only", None)
    only = Ablation(
        _names(given.pop("textures", None)),
        parse_speeds(given.pop("speeds", None)),
        given.pop("markers", 1.0),
        given.pop("train_speeds", None),
        conditions_in([apart], "--test-only").popitem() if apart else None,
    )
    by_speed = given.get("split", SPEED.name) in (SPEED.name, TEXTURE)
    held_out = given.pop("held_out", None)
    groups = parse_speeds(held_out, "--held-out") if by_speed else _names(held_out)
    return {
        **given,
        "seeds": range(seed, seed + n_seeds),
        "only": only,
        "held_out": groups,
        "steady": parse_steady(given.get("steady")),
        "without": conditions_in(given.get("without", []), "--without"),
    }


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
    import afferents
    from afferents.reporting.report import compare_runs

    pages = [afferents.report(folder, quiet or as_json, figures) for folder in results]
    table, written = compare_runs(results)
    found = {"reports": [str(page) for page in pages], "table": str(written)}
    lines = [f"Report: {page}" for page in pages]
    say(as_json, found, TerminalTable.of(table), *lines, f"Table: {written}")


def status(
    results: Annotated[
        Path,
        typer.Argument(help="Folder that 'evaluate' or 'reproduce' writes, running or not."),
    ],
    as_json: Json = False,
) -> None:
    """Show how far an evaluation is, or a reproduction: done, running, failed, and when it ends."""
    from afferents.reproduction.run_folder import STATES
    from afferents.reproduction.run_folder import status as look

    found = look(results)
    table = TerminalTable(("model", "protocol", *STATES), found.rows, n_headers=2)
    say(as_json, found.facts, table, *found.sentences)


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",")) if text else ()


def _tables(summary: dict[str, Any]) -> list[TerminalTable]:
    """Return Table 1 where some of its models were evaluated, and what our own came to."""
    from afferents.reporting.accuracy_figures import lengths_table
    from afferents.reporting.comparisons import by_touch_table, touches_table
    from afferents.reporting.tables import table1

    evaluated = set(summary["models"])
    tables = [table1(summary)] if evaluated & set(TABLE1) else []
    tables += [touches_table(summary)] if evaluated - set(TABLE1) else []
    tables += [table for of in (lengths_table, by_touch_table) if (table := of(summary))]
    return [TerminalTable.of(table) for table in tables]


def _texture_tables(summaries: dict[str, Any]) -> list[TerminalTable]:
    from afferents.reporting.textures import texture_tables

    return [TerminalTable.of(table) for table in texture_tables(summaries)]

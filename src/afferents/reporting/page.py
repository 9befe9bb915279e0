"""`report.html`: one page that holds all it shows and needs no network."""

import base64
import json
import re
import shlex
from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from afferents.evaluation.options import shell_words
from afferents.evaluation.results import CONFIG, Results, Summary
from afferents.folds.held_out import SPEED
from afferents.models.model import MODELS
from afferents.reporting.comparisons import beside_paper, differences
from afferents.reporting.labels import (
    ABBREVIATIONS,
    PROTOCOL_TITLES,
    data_line,
    model_order,
    model_title,
    outcomes,
    percent,
    shortened,
    textures_line,
)
from afferents.reporting.published import CITATION
from afferents.reporting.style import ReportFigure
from afferents.reporting.summary_text import (
    beside_the_winner,
    headline,
    next_steps,
    sureness,
    what_was_asked,
    what_was_lost,
)
from afferents.reporting.tables import (
    accuracy_tables,
    heads_of,
    leak_sentences,
    leak_table,
    run_table,
)
from afferents.store.trimming import written
from afferents.version import __version__

_UNITS = re.compile(r"(?<=\d) (?=(mm/s|mm|ms|s|px|Hz|MB)\b)")
"""Spaces between a number and its unit: a line must not break there."""


def render_report(
    results: Results, pictures: Sequence[ReportFigure], notes: Sequence[str] = ()
) -> str:
    """Return the page of an evaluation.

    Parameters
    ----------
    pictures
        From `draw_pictures`; may be empty.
    notes
        Sentences for the reader, such as why a figure is missing.
    """
    summary = results.found
    first, *others = accuracy_tables(results)
    tables = [first, differences(summary), *others]
    drawn = [(one, base64.b64encode(one.png).decode("ascii")) for one in pictures]
    n_leading = 1 if summary.models else 0  # accuracy by what was held out: see `draw_pictures`
    return _filled(
        "report.html",
        data=summary.data,
        simulated=[data for data in summary.data if data.simulated],
        skipped=summary.skipped,
        issues=summary.issues,
        version=summary.afferents,
        held_out=summary.split,
        asked=what_was_asked(summary),
        headline=headline(summary),
        beside=beside_the_winner(summary),
        sureness=sureness(summary),
        steps=next_steps(summary, results.root),
        facts=facts(summary),
        lost=what_was_lost(summary.lost),
        notes=notes,
        accuracies=[one for one in tables if one is not None],
        folds=beside_paper(summary),
        leak_sentences=leak_sentences(summary),
        leaks=leak_table(summary),
        runs=run_table(summary),
        leading=drawn[:n_leading],
        pictures=drawn[n_leading:],
        config=json.dumps(results.config, indent=2),
        command=redo_command(results),
    )


def render_tables(title: str, tables: Iterable[pd.DataFrame]) -> str:
    """Return a page of tables alone."""
    return _filled("tables.html", title=title, tables=list(tables), version=__version__)


def _filled(template: str, **content: Any) -> str:
    environment = Environment(
        loader=PackageLoader("afferents.reporting", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"prose": keep_units, "heads": heads_of, "rows": _rows}
    page: str = environment.get_template(template).render(citation=CITATION, **content)
    return page


def keep_units(text: str) -> str:
    """Return a text whose lines do not break between a number and its unit."""
    return _UNITS.sub("\N{NO-BREAK SPACE}", text)


def _rows(table: pd.DataFrame) -> list[tuple[tuple[str, ...], list[Any]]]:
    """Return the headers and the other cells of each row."""
    return list(zip(table.index, table.to_numpy().tolist(), strict=True))


def facts(summary: Summary) -> list[tuple[str, str]]:
    """Return what was evaluated, as pairs of name and value."""
    split, groups = summary.split, summary.held_out_keys
    title = "Speeds" if split == SPEED else f"Held out: {split.title}"
    run = {protocol for _, protocol, _ in outcomes(summary)}
    titles = ", ".join(model_title(name, summary) for name in model_order(summary))
    abbreviated = [f"{one}: {what}" for one, what in ABBREVIATIONS.items()
                   if re.search(rf"-{one}\b", titles)]  # fmt: skip
    corrupted = {"tested": summary.disturb, "learnt from": summary.disturb_training}
    own = [
        (f"Set otherwise: {network}", ", ".join(f"{name} = {value}" for name, value in its.items()))
        for network, its in summary.recipe.items()
    ]
    steady = f"{written(summary.steady_s)} s (--steady)" if summary.steady_s else ""
    said = [
        ("Data", data_line(summary)),
        ("Textures", textures_line(summary)),
        (title, f"{len(groups)}: {shortened(groups)}{split.unit}"),
        ("Models", titles),
        ("Their names", "; ".join(abbreviated)),
        ("Protocol", " and ".join(name for name in PROTOCOL_TITLES if name in run) or "none"),
        ("Trimming and preset", f"{summary.cut}, {summary.preset}"),
        ("Steady part", steady),
        ("Asked for", shlex.join(shell_words(summary.options))),
        *own,
        *((f"Corrupted when {when}", str(by)) for when, by in corrupted.items()),
        ("Chance", f"{percent(summary.chance)}%"),
    ]
    return [(name, value) for name, value in said if value]


def redo_command(results: Results) -> str:
    """Return the command that repeats the evaluation, or all that filled the folder."""
    summary, config = results.found, str(results.root / CONFIG)
    bases = {name: base for base, of in summary.lengths.items() for name in of.values()}
    lengths = sorted({n for of in summary.lengths.values() for n in of}, key=int)
    models = dict.fromkeys(bases.get(name, name) for name in model_order(summary))
    protocols = {protocol for _, protocol, _ in outcomes(summary)}
    seeds = sorted({seed for *_, found in outcomes(summary) for seed in found.seeds})
    arguments = ["--config", config, "--out", "AGAIN"]
    if len(protocols) > 1:  # the configuration holds what the last run was asked for
        arguments += ["--protocol", "both"]
    if len(seeds) > 1:
        arguments += ["--seed", str(seeds[0]), "--seeds", str(seeds[-1] - seeds[0] + 1)]
    if models.keys() <= MODELS.keys():  # others are found by the file that the configuration names
        arguments += ["--models", ",".join(models)]
    arguments += ["--frames", ",".join(lengths)] if lengths else []
    return shlex.join(["afferents", "evaluate", *arguments])

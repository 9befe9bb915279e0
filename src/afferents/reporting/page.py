"""`report.html`: one page that holds all it shows and needs no network."""

import base64
import json
import re
import shlex
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from afferents.evaluation.options import shell_words
from afferents.evaluation.results import CONFIG, Results, Summary
from afferents.folds.held_out import SPEED
from afferents.models.model import MODELS
from afferents.reporting import compare, labels, published, style, tables, text
from afferents.store.trimming import written
from afferents.version import __version__

_UNITS = re.compile(r"(?<=\d) (?=(mm/s|mm|ms|s|px|Hz|MB)\b)")
"""Spaces between a number and its unit: a line must not break there."""


def render_report(
    results: Results, pictures: Sequence[style.ReportFigure], notes: Sequence[str] = ()
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
    accuracies = (
        tables.table1(summary),
        compare.differences(summary),
        tables.group_table(summary),
        tables.recordings_table(summary),
        tables.lengths_table(summary),
        tables.touches_table(summary),
        tables.texture_table(results),
        tables.confidence_table(summary),
        tables.controls_table(summary),
    )
    drawn = [(one, base64.b64encode(one.png).decode("ascii")) for one in pictures]
    n_leading = 1 if summary.models else 0  # accuracy by what was held out: see `draw_pictures`
    return _render(
        "report.html",
        summary=summary,
        question=text.describe_question(summary),
        headline=text.headline(summary),
        findings=text.list_findings(summary),
        uncertainty=text.describe_uncertainty(summary),
        steps=text.list_next_steps(summary, results.root),
        facts=list_facts(summary),
        lost=text.describe_lost(summary.lost),
        notes=notes,
        accuracies=[one for one in accuracies if one is not None],
        folds=compare.compare_folds(summary),
        leak_sentences=tables.leak_sentences(summary),
        leaks=tables.leak_table(summary),
        runs=tables.run_table(summary),
        leading=drawn[:n_leading],
        pictures=drawn[n_leading:],
        config=json.dumps(results.config, indent=2),
        command=write_command(results),
    )


def render_tables(title: str, tables: Iterable[pd.DataFrame]) -> str:
    """Return a page of tables alone."""
    return _render("tables.html", title=title, tables=list(tables), version=__version__)


def _render(template: str, **content: Any) -> str:
    environment = Environment(
        loader=PackageLoader("afferents.reporting", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "prose": partial(_UNITS.sub, "\N{NO-BREAK SPACE}"),
        "heads": tables.list_heads,
        "rows": lambda table: zip(table.index, table.to_numpy().tolist(), strict=True),
    }
    page: str = environment.get_template(template).render(citation=published.CITATION, **content)
    return page


def list_facts(summary: Summary) -> list[tuple[str, str]]:
    """Return what was evaluated, as pairs of name and value."""
    split, groups = summary.split, summary.held_out_keys
    title = "Speeds" if split == SPEED else f"Held out: {split.title}"
    titles = ", ".join(labels.model_title(name, summary) for name in labels.list_models(summary))
    abbreviated = [f"{one}: {what}" for one, what in labels.ABBREVIATIONS.items()
                   if re.search(rf"-{one}\b", titles)]  # fmt: skip
    corrupted = {"tested": summary.disturb, "learnt from": summary.disturb_training}
    own = [
        (f"Set otherwise: {network}", ", ".join(f"{name} = {value}" for name, value in its.items()))
        for network, its in summary.recipe.items()
    ]
    facts = [
        ("Data", labels.data_line(summary)),
        ("Textures", labels.textures_line(summary)),
        (title, f"{len(groups)}: {labels.shorten_list(groups)}{split.unit}"),
        ("Models", titles),
        ("Their names", "; ".join(abbreviated)),
        ("Protocol", " and ".join(labels.list_protocols(summary)) or "none"),
        ("Trimming and preset", f"{summary.cut}, {summary.preset}"),
        ("Steady part", f"{written(summary.steady_s)} s (--steady)" if summary.steady_s else ""),
        ("Options", shlex.join(shell_words(summary.options))),
        *own,
        *((f"Corrupted when {when}", str(by)) for when, by in corrupted.items()),
        ("Chance", f"{labels.percent(summary.chance)}%"),
    ]
    return [(name, value) for name, value in facts if value]


def write_command(results: Results) -> str:
    """Return the command that repeats the evaluation, or all that filled the folder."""
    summary, config = results.found, str(results.root / CONFIG)
    bases = {name: base for base, of in summary.lengths.items() for name in of.values()}
    lengths = sorted({n for of in summary.lengths.values() for n in of}, key=int)
    models = dict.fromkeys(bases.get(name, name) for name in labels.list_models(summary))
    seeds = sorted({seed for *_, found in labels.outcomes(summary) for seed in found.seeds})
    arguments = ["--config", config, "--out", "AGAIN"]
    if len(labels.list_protocols(summary)) > 1:  # the configuration holds the last run's alone
        arguments += ["--protocol", "both"]
    if len(seeds) > 1:
        arguments += ["--seed", str(seeds[0]), "--seeds", str(seeds[-1] - seeds[0] + 1)]
    if models.keys() <= MODELS.keys():  # others are found by the file that the configuration names
        arguments += ["--models", ",".join(models)]
    arguments += ["--frames", ",".join(lengths)] if lengths else []
    return shlex.join(["afferents", "evaluate", *arguments])

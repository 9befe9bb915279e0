"""`report.html`: one page that holds all it shows and needs no network."""

import base64
import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from afferents.evaluation.results import Results
from afferents.files import write_text
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import SPEED, key_of, split_of
from afferents.reporting.accuracy_figures import (
    by_texture_table,
    has_reliability,
    lengths_table,
    reliability_table,
)
from afferents.reporting.comparisons import beside_paper, by_touch_table, differences, touches_table
from afferents.reporting.in_short import (
    beside_the_winner,
    headline,
    next_steps,
    sureness,
    what_was_asked,
    what_was_lost,
)
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    data_line,
    groups_in,
    model_order,
    model_title,
    outcomes,
    percent,
    texture_names,
)
from afferents.reporting.pictures import ReportFigure
from afferents.reporting.published import CITATION
from afferents.reporting.tables import (
    accuracy_by_speed,
    leak_sentences,
    leak_table,
    run_table,
    table1,
)
from afferents.store.trimming import written

TEMPLATE = "report.html"


@dataclass(frozen=True)
class Embedded:
    """A picture as the page holds it: PNG in base64 with its texts."""

    name: str
    title: str
    caption: str
    description: str
    png: str


def write_report(
    path: Path, results: Results, pictures: Sequence[ReportFigure], notes: Sequence[str] = ()
) -> Path:
    """Write the page, whole or not at all, and return its path.

    Parameters
    ----------
    path
        The file to write, such as `RESULTS/report.html`.
    pictures
        From `draw_pictures`; may be empty.
    notes
        Sentences for the reader, such as why a figure is missing.
    """
    page = render_report(results, pictures, notes)
    write_text(path, page)
    return path


def render_report(
    results: Results, pictures: Sequence[ReportFigure], notes: Sequence[str] = ()
) -> str:
    """Return the page as text; see `write_report`."""
    summary = results.summary
    split = split_of(summary)
    return template(TEMPLATE).render(
        held_out=split,
        asked=what_was_asked(summary),
        headline=headline(summary),
        beside=beside_the_winner(summary),
        sureness=sureness(summary),
        steps=next_steps(summary),
        facts=facts(summary),
        simulated=[data for data in summary["data"] if data["simulated"]],
        skipped=summary["skipped"],
        accepted=summary.get("accepted", ()),
        lost=what_was_lost(summary),
        notes=notes,
        table1=table1(summary),
        by_speed=accuracy_by_speed(summary),
        touches=touches_table(summary),
        by_touch=by_touch_table(summary),
        lengths=lengths_table(summary),
        by_texture=by_texture_table(results),
        folds=beside_paper(summary),
        reliability=reliability_table(summary) if has_reliability(summary) else None,
        differences=differences(summary),
        leak_sentences=leak_sentences(summary),
        leaks=leak_table(summary),
        runs=run_table(summary),
        pictures=[_embed(picture) for picture in pictures],
        data=summary["data"],
        config=json.dumps(results.config, indent=2),
        command=redo_command(results),
        citation=CITATION,
        version=summary["afferents"],
    )


def template(name: str) -> Template:
    """Return a template of a page."""
    environment = Environment(
        loader=PackageLoader("afferents.reporting", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def facts(summary: Summary) -> list[tuple[str, str]]:
    """Return what was evaluated, as pairs of name and value."""
    split = split_of(summary)
    groups = [key_of(group) for group in groups_in(summary)]
    title = "Speeds" if split == SPEED else f"Held out: {split.name}"
    steady = summary.get("steady_s")
    run = {protocol for _, protocol, _ in outcomes(summary)}
    protocols = [name for name in PROTOCOL_TITLES if name in run]
    return [
        ("Data", data_line(summary)),
        ("Textures", textures_line(summary)),
        (title, f"{len(groups)}: {shortened(groups)}{split.unit}"),
        ("Models", ", ".join(model_title(name, summary) for name in model_order(summary))),
        ("Protocol", " and ".join(protocols) or "none"),
        ("Cut and preset", f"{summary['cut']}, {summary['preset']}"),
        *([("Steady part", f"{written(steady)} s (--steady)")] if steady else []),
        *_set_otherwise(summary),
        *_corrupted(summary),
        ("Chance", f"{percent(summary['chance'])} %"),
    ]


def textures_line(summary: Summary) -> str:
    """Return how many textures there are, their names and, once, what letters stand for."""
    textures = summary["textures"]
    names = list(texture_names(textures, summary).values())
    line = f"{len(names)}: {shortened(names)}"
    if names == list(textures):
        return line
    return f"{line}; letters as in the paper, for bumps {shortened(textures)} mm apart"


def _set_otherwise(summary: Summary) -> list[tuple[str, str]]:
    """Return which hyperparameters were not the preset's, a line for each network that has some."""
    return [
        (f"Set otherwise: {network}", ", ".join(f"{name} = {value}" for name, value in own.items()))
        for network, own in summary.get("recipe", {}).items()
    ]


def _corrupted(summary: Summary) -> list[tuple[str, str]]:
    """Return what corrupted the recordings, if anything did."""
    said = {
        "Corrupted when tested": summary.get("disturb"),
        "Corrupted when learnt from": summary.get("disturb_training"),
    }
    return [(head, str(Corruption(**by))) for head, by in said.items() if by]


def redo_command(results: Results) -> str:
    """Return the command that repeats the evaluation."""
    summary = results.summary
    found = list(outcomes(summary))
    seeds = sorted({seed for _, _, result in found for seed in result["seeds"]}) or [0]
    protocols = {protocol for _, protocol, _ in found}
    arguments = [
        *(data["source"] for data in summary["data"]),
        *("--out", results.root.name or "RESULTS"),
        *("--models", ",".join(dict.fromkeys(_asked_for(summary)))),
        *("--protocol", "both" if len(protocols) > 1 else "".join(protocols)),
        *("--cut", summary["cut"], "--preset", summary["preset"]),
        *("--seed", str(seeds[0]), "--seeds", str(len(seeds))),
        *summary.get("options", []),
        *_lengths(summary),
    ]
    return shlex.join(["afferents", "evaluate", *arguments])


def _asked_for(summary: Summary) -> Iterator[str]:
    """Yield the models as they were asked for: of several lengths the one that they are."""
    bases = {name: base for base, of in summary.get("lengths", {}).items() for name in of.values()}
    for name in model_order(summary):
        yield bases.get(name, name)


def _lengths(summary: Summary) -> list[str]:
    """Return the words that ask for the same lengths of windows, if there were several."""
    lengths = {n for of in summary.get("lengths", {}).values() for n in of}
    return ["--frames", ",".join(sorted(lengths, key=int))] if lengths else []


def shortened(names: Sequence[str], most: int = 16) -> str:
    """Return names with commas between, or the first of very many and the last."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])}, … {names[-1]}"


def _embed(picture: ReportFigure) -> Embedded:
    return Embedded(
        picture.name,
        picture.title,
        picture.caption,
        picture.description,
        base64.b64encode(picture.png).decode("ascii"),
    )

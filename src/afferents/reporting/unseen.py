"""Tables and page of an evaluation that holds out textures as well as speeds."""

import shlex
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from afferents.evaluation.schemas import (
    RoughnessSummary,
    ShareUnknown,
    Unit,
    UnknownOutcome,
    UnknownSummary,
)
from afferents.folds.held_out import key_of
from afferents.reporting.labels import (
    ABSENT,
    data_line,
    drawn_over,
    interval_note,
    model_title,
    percent,
    shortened,
    spacing_note,
    texture_names,
    textures_line,
    with_interval,
)
from afferents.reporting.page import render
from afferents.reporting.summary_text import what_was_lost
from afferents.reporting.tables import make_table

KINDS = {"seen": "learnt at other speeds", "unseen": "held out"}
TextureSummaries = Mapping[str, UnknownSummary | RoughnessSummary]
"""By question; what is unknown is always asked, and stands first."""


def texture_tables(summaries: TextureSummaries) -> list[pd.DataFrame]:
    """Return the tables of `--split texture`, from its summaries by question."""
    tables = []
    for summary in summaries.values():
        if isinstance(summary, UnknownSummary):
            tables += [unknown_table(summary), unknown_by_texture(summary)]
        else:
            tables.append(roughness_table(summary))
    return tables


def roughness_table(summary: RoughnessSummary) -> pd.DataFrame:
    """Return the errors in mm of every model, for textures learnt before and held out."""

    def worst(errors: dict[str, float], unit: str) -> str:
        most = max(errors, key=lambda key: errors[key])
        return f"{most} {unit}: {errors[most]:.2f}"

    return make_table(
        "Bump spacing as a number, at speeds held out of training",
        "Mean absolute error in mm, mean over held-out speeds; between: of those that lie between "
        "others; recordings: of the mean over a recording. Intervals are as wide as "
        f"{percent(summary.coverage_asked, 0)}% of the errors inside the training data; beside "
        "them stands the share of the held-out samples that they held, which nothing promises.",
        ("Model", "Textures", "Samples", "Between", "Recordings", "Worst speed", "Worst spacing",
         "Interval by inner errors, and share that it held"),
        (
            (
                model_title(model, summary),
                KINDS[kind],
                f"{found.mae_mm:.2f}",
                ABSENT if found.mae_mm_inside is None else f"{found.mae_mm_inside:.2f}",
                f"{found.mae_mm_recordings:.2f}",
                worst(found.by_speed, "mm/s"),
                worst(found.by_spacing, "mm"),
                f"±{found.half_interval_mm:.2f}: {percent(found.covered)}%",
            )
            for model, kinds in summary.models.items()
            for kind, found in kinds.items()
        ),
        n_headers=2,
    )  # fmt: skip


def unknown_table(summary: UnknownSummary) -> pd.DataFrame:
    """Return false alarms stated and measured, and what is found, of every model."""
    stated = percent(summary.false_alarms_stated, 0)
    return make_table(
        "Textures held out, recognised as unknown at speeds held out of training",
        f"Percent, mean over held-out speeds, with 95% interval in brackets (over "
        f"{drawn_over(summary)}). Inside: those that lie between others, for which {stated}% "
        f"false alarms are stated. Outside: the slowest and the fastest, which lie outside what "
        f"was learnt when they are held out; no rate is stated there, and 'unknown' says nothing. "
        f"For each texture left out at each speed held out, a model learns from the others and "
        f"calls unknown what lies farther from them than "
        f"{percent(1 - summary.false_alarms_stated, 0)} in 100 samples of known textures do at "
        f"other speeds, each left out in its turn. A recording is judged by the mean over its "
        f"samples, with a limit of its own.",
        ("Model", "Of", "Speeds", f"False alarms ({stated} stated)", "Found unknown", "AUROC",
         "Most false alarms, at mm/s", "Fewest found, at mm/s"),
        (
            (model_title(model, summary), f"a {unit.removesuffix('s')}", *row)
            for model, found in summary.models.items()
            for unit in found.found
            for row in _unknown_rows(found, unit)
        ),
        n_headers=3,
    )  # fmt: skip


def _unknown_rows(found: UnknownOutcome, unit: Unit) -> list[tuple[str, ...]]:
    """Return a row of speeds inside and one outside what was learnt, or one of all speeds."""
    alarms, finds = found.false_alarms[unit], found.found[unit]
    ranked = sorted(alarms.by_speed, key=float)

    def row(
        where: str, shares: tuple[ShareUnknown, ShareUnknown], area: float | None, speeds: list[str]
    ) -> tuple[str, ...]:
        most = max(speeds, key=lambda speed: alarms.by_speed[speed])
        fewest = min(speeds, key=lambda speed: finds.by_speed[speed])
        return (
            where,
            *(with_interval(one.mean, one.ci95) for one in shares),
            f"{area:.3f}",
            f"{percent(alarms.by_speed[most])} at {most}",
            f"{percent(finds.by_speed[fewest])} at {fewest}",
        )

    if not (alarms.inside and finds.inside and alarms.outside and finds.outside):
        return [row("all", (alarms, finds), found.auroc[unit], ranked)]
    inside, outside = (alarms.inside, finds.inside), (alarms.outside, finds.outside)
    ends = [ranked[0], ranked[-1]]
    return [
        row("inside", inside, found.auroc_inside[unit], ranked[1:-1]),
        row("outside what was learnt", outside, found.auroc_outside[unit], ends),
    ]


def unknown_by_texture(summary: UnknownSummary) -> pd.DataFrame:
    """Return, for each texture, how often it is called unknown: left out, and learnt from."""
    note = spacing_note(summary)
    names = texture_names(summary.textures, summary.named_by_spacing)
    return make_table(
        "Called unknown, by texture",
        "Percent of samples. Held out: few where a texture is hidden between its neighbours, which "
        f"it is taken for. Learnt: false alarms. {note[:1].upper()}{note[1:]}",
        ("Model", "Texture was", *names.values()),
        (
            (
                model_title(model, summary),
                title,
                *(100 * getattr(found.by_texture[texture], key) for texture in names),
            )
            for model, found in summary.models.items()
            for key, title in (("found_samples", "held out"), ("false_alarms", "learnt"))
        ),
        n_headers=2,
    )


# The page of an evaluation that holds out textures as well as speeds.


def render_textures(summaries: TextureSummaries, folder: Path) -> str:
    """Return the page of `--split texture`, whose results lie in a folder."""
    summary = next(iter(summaries.values()))
    assert isinstance(summary, UnknownSummary)  # which is always asked
    arguments = [
        *(data.source for data in summary.data),
        *("--out", folder.name or "RESULTS", "--split", "texture"),
        *("--models", ",".join(summary.models), "--cut", summary.cut),
        *summary.options,
        *(["--keep-going"] if summary.skipped else ()),
    ]
    speeds = shortened([key_of(v) for v in summary.speeds_mm_s])
    return render(
        "textures.html",
        summary,
        headline=_headline(summary),
        sureness=interval_note(summary),
        facts=[
            ("Data", data_line(summary)),
            ("Textures", textures_line(summary)),
            ("Speeds", f"{len(summary.speeds_mm_s)}: {speeds} mm/s"),
            ("Models", ", ".join(model_title(name, summary) for name in summary.models)),
            ("Protocol", "nested"),
            ("Cut", summary.cut),
        ],
        lost=what_was_lost(summary.lost),
        tables=texture_tables(summaries),
        command=shlex.join(["afferents", "evaluate", *arguments]),
    )


def _headline(summary: UnknownSummary) -> str:
    """Return what the model that tells unknown from known best comes to."""
    best = max(summary.models, key=lambda model: summary.models[model].auroc["samples"] or 0)
    of_best = summary.models[best]
    finds, alarms = of_best.found["samples"], of_best.false_alarms["samples"]
    found, false = (
        (finds.inside, alarms.inside) if finds.inside and alarms.inside else (finds, alarms)
    )
    where = "at speeds between those learnt from" if finds.inside else "at speeds held out"
    title = model_title(best, summary)
    return (
        f"{title[0].upper()}{title[1:]} does best: {where} it calls {percent(found.mean)}% of the "
        f"samples of textures held out unknown, and {percent(false.mean)}% of those of textures "
        f"that it has learnt, where {percent(summary.false_alarms_stated, 0)}% are stated."
    )

"""Tables and page of an evaluation that leaves out textures as well as speeds."""

import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from afferents.evaluation.results import ROUGHNESS, UNKNOWN
from afferents.evaluation.schemas import Lost
from afferents.files import write_text
from afferents.reporting.html import shortened, template, textures_line
from afferents.reporting.in_short import what_was_lost
from afferents.reporting.labels import (
    ABSENT,
    Summary,
    data_line,
    drawn_over,
    interval_note,
    model_title,
    percent,
    spacing_note,
    speed_key,
    texture_names,
)
from afferents.reporting.published import CITATION
from afferents.reporting.tables import Cell, Table

KINDS = {"seen": "felt at other speeds", "unseen": "never felt"}


def roughness_table(summary: dict[str, Any]) -> Table:
    """Return the errors in mm of every model, for textures felt before and never felt."""
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(KINDS[kind]),
            *(Cell(_mm(found[key])) for key in ("mae_mm", "mae_mm_inside", "mae_mm_recordings")),
            Cell(_worst_mm(found["by_speed"], "mm/s")),
            Cell(_worst_mm(found["by_spacing"], "mm")),
            Cell(f"+-{_mm(found['half_interval_mm'])}: {percent(found['covered'])} %"),
        )
        for model, kinds in summary["models"].items()
        for kind, found in kinds.items()
    ]
    return Table(
        "Bump spacing as a number, at speeds held out of training",
        "Mean absolute error in mm, mean over held-out speeds; between: of those that lie between "
        "others; recordings: of the mean over a recording. Intervals are as wide as "
        f"{percent(summary['coverage_asked'], 0)} % of the errors inside the training data; "
        "beside them stands the share of the held-out samples that they held, which nothing "
        "promises.",
        ("Model", "Textures", "Samples", "Between", "Recordings", "Worst speed", "Worst spacing",
         "Interval by inner errors, and share that it held"),
        tuple(rows),
        n_headers=2,
    )  # fmt: skip


def _mm(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.2f}"


def _worst_mm(errors: dict[str, float], unit: str) -> str:
    worst = max(errors, key=lambda key: errors[key])
    return f"{worst} {unit}: {errors[worst]:.2f}"


# The tables of an evaluation that asks whether a texture never felt is recognised as unknown.


def texture_tables(summaries: Mapping[str, dict[str, Any]]) -> list[Table]:
    """Return the tables of `--split texture`, from its summaries by question."""
    unknown, mm = summaries.get(UNKNOWN), summaries.get(ROUGHNESS)
    tables = [unknown_table(unknown), unknown_by_texture(unknown)] if unknown else []
    return tables + ([roughness_table(mm)] if mm else [])


def unknown_table(summary: dict[str, Any]) -> Table:
    """Return false alarms stated and measured, and what is found, of every model."""
    stated = percent(summary["false_alarms_stated"], 0)
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(title),
            Cell(speeds),
            *_outcome(found, unit, key),
        )
        for model, found in summary["models"].items()
        for unit, title in (("samples", "a sample"), ("recordings", "a recording"))
        for speeds, key in _SPEEDS.items()
        if _has(found, unit, key)
    ]
    return Table(
        "Textures never felt, recognised as unknown at speeds held out of training",
        f"Percent, mean over held-out speeds, with 95% interval in brackets (over "
        f"{drawn_over(summary)}). Inside: those that lie between others, for which {stated} % "
        f"false alarms are stated. Outside: the slowest and the fastest, which lie outside what "
        f"was learnt when they are held out; no rate is stated there, and 'unknown' says nothing. "
        f"For each texture left out at each speed held out, a model learns from the others and "
        f"calls unknown what lies farther from them than "
        f"{percent(1 - summary['false_alarms_stated'], 0)} in 100 samples of known textures do at "
        f"other speeds, each left out in its turn. A recording is judged by the mean over its "
        f"samples, with a limit of its own.",
        ("Model", "Of", "Speeds", f"False alarms ({stated} stated)", "Found unknown", "AUROC",
         "Most false alarms, at mm/s", "Fewest found, at mm/s"),
        tuple(rows),
        n_headers=3,
    )  # fmt: skip


def unknown_by_texture(summary: dict[str, Any]) -> Table:
    """Return, for each texture, how often it is called unknown: left out, and learnt from."""
    note = spacing_note(summary)
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(title),
            *(_cell(found["by_texture"][t][key]) for t in summary["textures"]),
        )
        for model, found in summary["models"].items()
        for key, title in (("found_samples", "never felt"), ("false_alarms", "felt"))
    ]
    return Table(
        "Called unknown, by texture",
        "Percent of samples. Never felt: few where a texture is hidden between its neighbours, "
        f"which it is taken for. Felt: false alarms. {note[:1].upper()}{note[1:]}".rstrip(),
        ("Model", "Texture was", *texture_names(summary["textures"], summary).values()),
        tuple(rows),
        n_headers=2,
    )


_SPEEDS = {"inside": "inside", "outside what was learnt": "outside", "all": ""}
"""Held-out speeds in words, and by their key; all where none lie between others."""


def _has(found: dict[str, Any], unit: str, key: str) -> bool:
    """Tell whether some held-out speeds have a row of their own."""
    shares = found["found"][unit]
    return bool(shares.get(key)) if key else not shares.get("outside")


def _outcome(found: dict[str, Any], unit: str, key: str) -> tuple[Cell, ...]:
    """Return the cells of samples or recordings, at speeds inside, outside or at all."""
    alarms, finds = (found[what][unit] for what in ("false_alarms", "found"))
    area = found[f"auroc_{key}" if key else "auroc"][unit]
    return (
        Cell(_share(alarms[key] if key else alarms)),
        Cell(_share(finds[key] if key else finds)),
        Cell(f"{area:.3f}"),
        Cell(_worst(alarms["by_speed"], key, max)),
        Cell(_worst(finds["by_speed"], key, min)),
    )


def _share(found: dict[str, Any]) -> str:
    low, high = found["ci95"]
    return f"{percent(found['mean'])} [{percent(low)}, {percent(high)}]"


def _worst(by_speed: dict[str, float], key: str, worse: Callable[..., str]) -> str:
    ranked = sorted(by_speed, key=float)
    speeds = {"inside": ranked[1:-1], "outside": [ranked[0], ranked[-1]]}.get(key, ranked)
    worst = worse(speeds, key=lambda key: by_speed[key])
    return f"{percent(by_speed[worst])} at {worst}"


def _cell(share: float) -> Cell:
    return Cell(percent(share), 100 * share)


# The page of an evaluation that leaves out textures as well as speeds.


def write_texture_page(path: Path, summaries: Mapping[str, dict[str, Any]]) -> Path:
    """Write the page of `--split texture`, whole or not at all, and return its path.

    Parameters
    ----------
    path
        The file to write, such as `RESULTS/report.html`.
    summaries
        By question; what is unknown is always asked.
    """
    summary = summaries[UNKNOWN]
    page = template("textures.html").render(
        headline=_headline(summary),
        sureness=interval_note(summary),
        facts=_facts(summary),
        simulated=[data for data in summary["data"] if data["simulated"]],
        skipped=summary["skipped"],
        accepted=summary.get("accepted", ()),
        lost=what_was_lost(Lost(**lost) if (lost := summary.get("lost")) else None),
        tables=texture_tables(summaries),
        command=_redo_command(summary, path.parent.name or "RESULTS"),
        citation=CITATION,
        version=summary["afferents"],
    )
    write_text(path, page)
    return path


def _headline(summary: Summary) -> str:
    """Return what the model that tells unknown from known best comes to."""
    models = summary["models"]
    best = max(models, key=lambda model: models[model]["auroc"]["samples"])
    both = [models[best][key]["samples"] for key in ("found", "false_alarms")]
    inner = all(one["inside"] for one in both)
    found, alarms = ((one["inside"] if inner else one)["mean"] for one in both)
    where = "at speeds between those learnt from" if inner else "at speeds held out"
    title, stated = model_title(best, summary), percent(summary["false_alarms_stated"], 0)
    return (
        f"{title[0].upper()}{title[1:]} does best: {where} it calls {percent(found)} % of "
        f"the samples of textures never felt unknown, and {percent(alarms)} % of those "
        f"of textures that it has felt, where {stated} % are stated."
    )


def _facts(summary: Summary) -> list[tuple[str, str]]:
    speeds = shortened([speed_key(v) for v in summary["speeds_mm_s"]])
    return [
        ("Data", data_line(summary)),
        ("Textures", textures_line(summary)),
        ("Speeds", f"{len(summary['speeds_mm_s'])}: {speeds} mm/s"),
        ("Models", ", ".join(model_title(name, summary) for name in summary["models"])),
        ("Protocol", "nested"),
        ("Cut", summary["cut"]),
    ]


def _redo_command(summary: Summary, out: str) -> str:
    arguments = [
        *(data["source"] for data in summary["data"]),
        *("--out", out, "--split", "texture", "--models", ",".join(summary["models"])),
        *("--cut", summary["cut"]),
        *summary["options"],
    ]
    return shlex.join(["afferents", "evaluate", *arguments])
